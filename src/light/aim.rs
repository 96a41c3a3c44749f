//! Light sent on purpose towards what focuses it: from a point of a lamp in a direction in which a mirror or a lens lies.
//!
//! Behind glass, or in a mirror, a lamp cannot be chosen by the surface that it lights; only chance finds it there, and what
//! it finds rarely is bright. Paths that start at the lamp find it easily, if they start towards the glass: uniformly in the cones under which
//! the point of the lamp sees the balls around such objects, every cone with a share of its solid angle.
//!
//! ```text
//! p(x, ω) = P(lamp) / area × (cones that hold ω) / (sum of the cones' solid angles)
//! ```

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};

use super::{Shape, lights::Emitter};
use crate::{
    geometry::Frame,
    sampling::{
        distribution::{Discrete, ONE_MINUS_EPSILON},
        warp::{uniform_cone, uniform_sphere},
    },
};

/// Paths through a pixel for each path from a lamp. Most of what light from lamps improves a few paths improve: twice as many cost
/// a fifth more time for a hundredth less error in a box with two balls.
pub const SAMPLES_A_LAMP_PATH: u32 = 4;

/// More objects than this are taken together as one ball: a cone's share is found by looking at all.
const MAX_BALLS: usize = 64;

/// A ball of this many times the radius still holds its object after rounding.
const MARGIN: f32 = 1.0001;

/// Emissive surfaces, and the balls around what focuses their light.
#[derive(Clone, Debug)]
pub struct Aim {
    /// By emitter.
    choice: Discrete,
    sources: Vec<Option<Source>>,
    balls: Vec<Ball>,
}

#[derive(Clone, Copy, Debug)]
struct Source {
    object: u32,
    primitive: u32,
    shape: Shape,
    two_sided: bool,
}

#[derive(Clone, Copy, Debug)]
struct Ball {
    center: Vec3,
    radius: f32,
}

/// A point of a lamp and a direction from there.
#[derive(Clone, Copy, Debug)]
pub struct Departure {
    pub emitter: u32,
    pub object: u32,
    pub primitive: u32,
    pub point: Vec3,
    /// Geometric, unit.
    pub normal: Vec3,
    /// As [`ShapeSample`](super::shape::ShapeSample) has it.
    pub uv: Vec2,
    pub direction: Vec3,
    /// Over area and solid angle, m⁻² sr⁻¹.
    pub pdf: f32,
}

impl Aim {
    /// Towards sharply focusing and glossy objects within balls (center and radius). `None` where no surface emits or nothing is
    /// to be aimed at.
    pub fn new(emitters: &[Emitter], sharp: &[(Vec3, f32)], glossy: &[(Vec3, f32)]) -> Option<Self> {
        let ball = |&(center, radius): &(Vec3, f32)| Ball { center, radius: MARGIN * radius };
        let usable = |ball: &Ball| ball.center.is_finite() && ball.radius.is_finite() && ball.radius > 0.0;
        let [mut balls, glossy] =
            [sharp, glossy].map(|all| all.iter().map(ball).filter(usable).collect::<Vec<Ball>>());
        if balls.len() + glossy.len() <= MAX_BALLS {
            balls.extend(glossy);
        }
        if balls.len() > MAX_BALLS {
            let low = balls.iter().map(|b| b.center - b.radius).fold(Vec3::INFINITY, Vec3::min);
            let high = balls.iter().map(|b| b.center + b.radius).fold(Vec3::NEG_INFINITY, Vec3::max);
            balls = vec![ball(&(0.5 * (low + high), 0.5 * low.distance(high)))];
        }
        // about what it sends to the balls
        let weight = |emitter: &Emitter| match *emitter {
            Emitter::Surface { shape, power, two_sided, .. } if shape.area() > 0.0 => {
                power * solid_angle(&balls, shape.cluster(power, two_sided).center())
            }
            _ => 0.0,
        };
        let source = |emitter: &Emitter| match *emitter {
            Emitter::Surface { object, primitive, shape, two_sided, .. } => {
                Some(Source { object, primitive, shape, two_sided })
            }
            Emitter::Punctual(_) => None,
        };
        let choice = Discrete::new(emitters.iter().map(weight))?;
        let sources = emitters.iter().map(source).collect();
        (!balls.is_empty()).then_some(Self { choice, sources, balls })
    }

    /// `None` where the light would have to leave the back of a surface that does not shine there.
    pub fn sample(&self, [u_lamp, u_ball]: [f32; 2], u_point: Vec2, u: Vec2) -> Option<Departure> {
        let chosen = self.choice.sample(u_lamp);
        let Source { object, primitive, shape, two_sided } = self.sources[chosen.index]?;
        let (point, normal, uv) = shape.sample_area(u_point);
        let total = solid_angle(&self.balls, point);
        let mut left = u_ball * total;
        let mut cone = self.balls.first()?.seen_from(point);
        for ball in &self.balls {
            cone = ball.seen_from(point);
            if left < cone.solid_angle {
                break;
            }
            left -= cone.solid_angle;
        }
        let direction = cone.sample(u);
        let cos = direction.dot(normal);
        let pdf = chosen.probability / shape.area() * self.directions(point, direction);
        (pdf > 0.0 && pdf.is_finite() && (cos > 0.0 || two_sided && cos < 0.0)).then_some(Departure {
            emitter: chosen.index as u32,
            object,
            primitive,
            point,
            normal,
            uv,
            direction,
            pdf,
        })
    }

    /// The density with which [`sample`](Self::sample) draws this point of an emitter and this direction, m⁻² sr⁻¹.
    pub fn pdf(&self, emitter: u32, point: Vec3, direction: Vec3) -> f32 {
        match self.sources.get(emitter as usize) {
            Some(Some(source)) => {
                let pdf = self.choice.probability(emitter as usize) / source.shape.area()
                    * self.directions(point, direction);
                if pdf.is_finite() { pdf } else { 0.0 }
            }
            _ => 0.0,
        }
    }

    fn directions(&self, point: Vec3, direction: Vec3) -> f32 {
        let (holding, total) = self.balls.iter().fold((0, 0.0), |(holding, total), ball| {
            let cone = ball.seen_from(point);
            (holding + u32::from(cone.holds(direction)), total + cone.solid_angle)
        });
        holding as f32 / total
    }
}

/// Of all of them together, seen from a point, sr.
fn solid_angle(balls: &[Ball], point: Vec3) -> f32 {
    balls.iter().map(|ball| ball.seen_from(point).solid_angle).sum()
}

impl Ball {
    fn seen_from(&self, point: Vec3) -> Cone {
        let to_center = self.center - point;
        let distance = to_center.length();
        if distance <= self.radius {
            return Cone { axis: Vec3::Y, height: 2.0, solid_angle: 4.0 * PI };
        }
        let sin = self.radius / distance;
        let cos = ((1.0 - sin) * (1.0 + sin)).sqrt();
        let height = sin * sin / (1.0 + cos);
        Cone { axis: to_center / distance, height, solid_angle: TAU * height }
    }
}

/// Directions within 1 − cos ≤ `height` of the axis.
struct Cone {
    axis: Vec3,
    height: f32,
    solid_angle: f32,
}

impl Cone {
    fn sample(&self, u: Vec2) -> Vec3 {
        let u = u.min(Vec2::splat(ONE_MINUS_EPSILON));
        if self.height >= 2.0 {
            return uniform_sphere(u);
        }
        Frame::from_z(self.axis).to_world(uniform_cone(u, self.height)).normalize()
    }

    /// (1 − cos θ is half the squared chord: it keeps its digits for thin cones.)
    fn holds(&self, direction: Vec3) -> bool {
        0.5 * direction.distance_squared(self.axis) <= self.height * (1.0 + 1e-5)
    }
}
