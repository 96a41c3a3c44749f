//! Light sent on purpose towards what focuses it: from a point of a lamp in a direction in which a mirror, a lens or metal lies.
//!
//! Behind glass, or in a mirror, a lamp cannot be chosen by the surface that it lights; only chance finds it there, and what
//! it finds rarely is bright. Paths that start at the lamp find it easily, if they start towards the glass: uniformly in the cones under which
//! the point of the lamp sees the balls around such objects, every cone with a share of its solid angle. Lamps are chosen by power
//! times the solid angle of all cones.
//!
//! ```text
//! p(x, ω) = P(lamp) / area × (cones that hold ω) / (sum of the cones' solid angles)
//! ```
//!
//! A round lamp that is small beside the balls takes the cones of its middle towards balls larger by its radius R, then a point of the side that
//! faces the direction, by the cosine: cos θ / (π R²) in place of 1 / area.

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};

use super::{Shape, lights::Emitter, sphere::Sphere};
use crate::{
    geometry::Frame,
    sampling::{
        distribution::{Discrete, ONE_MINUS_EPSILON},
        warp::{concentric_disk, uniform_cone, uniform_sphere},
    },
};

/// Paths through a pixel for each path from a lamp. Most of what light from lamps improves a few paths improve: twice as many cost
/// a fifth more time for a hundredth less error in a box with two balls.
pub const SAMPLES_A_LAMP_PATH: u32 = 4;

/// More objects than this are taken together as one ball: a cone's share is found by looking at all.
const MAX_BALLS: usize = 64;

/// Solid angle towards a ball made larger by the radius of a round lamp, over that of the ball, at most: else paths start at points
/// of the lamp, half of which face away.
const MOST_WASTE: f32 = 2.0;

/// Of all light what goes to glossy objects where every path starts: where it is less, as many fewer do, since what they bring is
/// as much less of the picture.
const FULL_SHARE: f32 = 0.1;
/// Fewer paths than this share are not worth weighing anything against them.
const LEAST_EFFORT: f32 = 0.02;

/// A ball of this many times the radius still holds its object after rounding.
const MARGIN: f32 = 1.0001;

/// Emissive surfaces, and the balls around what focuses their light.
#[derive(Clone, Debug)]
pub struct Aim {
    /// The probability that a path starts at all.
    effort: f32,
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
    /// A small round lamp aims from its middle: the solid angle of all balls made larger by its own radius.
    middle: Option<(Sphere, f32)>,
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
        let balls = balls(sharp, glossy);
        let source = |emitter: &Emitter| match *emitter {
            Emitter::Surface { object, primitive, shape, power, two_sided } if shape.area() > 0.0 => {
                let center = shape.cluster(power, two_sided).center();
                let seen = solid_angle(&balls, center, 0.0);
                let middle = match shape {
                    Shape::Sphere(sphere) => Some((sphere, solid_angle(&balls, center, sphere.radius)))
                        .filter(|m| m.1 <= MOST_WASTE * seen),
                    _ => None,
                };
                (power, seen, Some(Source { object, primitive, shape, two_sided, middle }))
            }
            _ => (0.0, 0.0, None),
        };
        let sources: Vec<(f32, f32, Option<Source>)> = emitters.iter().map(source).collect();
        let choice = Discrete::new(sources.iter().map(|(power, seen, _)| power * seen))?;
        let power = sources.iter().map(|(power, ..)| f64::from(*power)).sum::<f64>();
        let share = choice.total() / (power * f64::from(4.0 * PI));
        let effort = if sharp.is_empty() { (share as f32 / FULL_SHARE).min(1.0) } else { 1.0 };
        let sources = sources.into_iter().map(|(.., source)| source).collect();
        (effort >= LEAST_EFFORT).then_some(Self { effort, choice, sources, balls })
    }

    /// `None` where no path is to start, or the light would have to leave the back of a surface that does not shine there.
    pub fn sample(&self, [u_lamp, u_ball]: [f32; 2], u_point: Vec2, u: Vec2) -> Option<Departure> {
        if u_lamp >= self.effort {
            return None;
        }
        let chosen = self.choice.sample((u_lamp / self.effort).min(ONE_MINUS_EPSILON));
        let source = self.sources[chosen.index].as_ref()?;
        let Source { object, primitive, shape, two_sided, middle } = *source;
        let (point, normal, uv, direction) = match middle {
            Some((Sphere { center, radius }, total)) => {
                let direction = self.draw(center, radius, total, u_ball, u)?;
                let across = concentric_disk(u_point);
                let facing = across.extend((1.0 - across.length_squared()).max(0.0).sqrt());
                let normal = Frame::from_z(direction).to_world(facing).normalize();
                (center + radius * normal, normal, Vec2::ZERO, direction)
            }
            None => {
                let (point, normal, uv) = shape.sample_area(u_point);
                let direction = self.draw(point, 0.0, solid_angle(&self.balls, point, 0.0), u_ball, u)?;
                (point, normal, uv, direction)
            }
        };
        let cos = direction.dot(normal);
        let pdf = self.effort * chosen.probability * self.density(source, point, normal, direction);
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
    pub fn pdf(&self, emitter: u32, point: Vec3, normal: Vec3, direction: Vec3) -> f32 {
        match self.sources.get(emitter as usize) {
            Some(Some(source)) => {
                let probability = self.effort * self.choice.probability(emitter as usize);
                let pdf = probability * self.density(source, point, normal, direction);
                if pdf.is_finite() { pdf } else { 0.0 }
            }
            _ => 0.0,
        }
    }

    /// Of a point of this lamp and a direction, m⁻² sr⁻¹.
    fn density(&self, source: &Source, point: Vec3, normal: Vec3, direction: Vec3) -> f32 {
        let holding =
            |from, extra| self.balls.iter().filter(|ball| ball.holds(from, extra, direction)).count() as f32;
        match source.middle {
            Some((Sphere { center, radius }, total)) => {
                let facing = normal.dot(direction).max(0.0) / (PI * radius * radius);
                facing * holding(center, radius) / total
            }
            None => holding(point, 0.0) / (solid_angle(&self.balls, point, 0.0) * source.shape.area()),
        }
    }

    /// A direction towards one of the balls, made larger by `extra`, which have this solid angle together.
    fn draw(&self, from: Vec3, extra: f32, total: f32, u_ball: f32, u: Vec2) -> Option<Vec3> {
        let mut left = u_ball * total;
        let mut cone = None;
        for ball in &self.balls {
            let seen = ball.seen_from(from, extra);
            let solid_angle = seen.solid_angle;
            cone = Some(seen);
            if left < solid_angle {
                break;
            }
            left -= solid_angle;
        }
        cone.map(|cone| cone.sample(u))
    }
}

/// All that is aimed at.
fn balls(sharp: &[(Vec3, f32)], glossy: &[(Vec3, f32)]) -> Vec<Ball> {
    let around = |&(center, radius): &(Vec3, f32)| Ball { center, radius: MARGIN * radius };
    let usable = |ball: &Ball| ball.center.is_finite() && ball.radius.is_finite() && ball.radius > 0.0;
    let [mut balls, glossy] =
        [sharp, glossy].map(|objects| objects.iter().map(around).filter(usable).collect::<Vec<Ball>>());
    if balls.len() + glossy.len() <= MAX_BALLS {
        balls.extend(glossy);
    } else if balls.len() > MAX_BALLS {
        let low = balls.iter().map(|b| b.center - b.radius).fold(Vec3::INFINITY, Vec3::min);
        let high = balls.iter().map(|b| b.center + b.radius).fold(Vec3::NEG_INFINITY, Vec3::max);
        balls = vec![around(&(0.5 * (low + high), 0.5 * low.distance(high)))];
    }
    balls
}

/// Of all balls together, made larger by `extra`, seen from a point, sr.
fn solid_angle(balls: &[Ball], from: Vec3, extra: f32) -> f32 {
    balls.iter().map(|ball| ball.seen_from(from, extra).solid_angle).sum()
}

impl Ball {
    fn seen_from(&self, point: Vec3, extra: f32) -> Cone {
        let to_center = self.center - point;
        let (distance, radius) = (to_center.length(), self.radius + extra);
        if distance <= radius {
            return Cone { axis: Vec3::Y, height: 2.0, solid_angle: 4.0 * PI };
        }
        let sin = radius / distance;
        let cos = ((1.0 - sin) * (1.0 + sin)).sqrt();
        let height = sin * sin / (1.0 + cos);
        Cone { axis: to_center / distance, height, solid_angle: TAU * height }
    }

    /// Whether a direction is one of that cone.
    fn holds(&self, point: Vec3, extra: f32, direction: Vec3) -> bool {
        let to_center = self.center - point;
        let radius = self.radius + extra;
        let along = to_center.dot(direction);
        let past = if along > 0.0 { to_center - along * direction } else { to_center };
        past.length_squared() <= radius * radius
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
}

#[cfg(test)]
mod tests;
