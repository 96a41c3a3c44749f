//! All the lights of a scene: choosing one for a point, and the densities that multiple importance sampling needs.
//!
//! Lights are of two sorts. *Infinite* ones (the environment and suns) light every point alike: among them the
//! choice is by the irradiance each could give, π × mean radiance for the environment. *Local* ones (surfaces, points,
//! spots) are chosen by a [tree](super::tree), for the irradiance they could give at the point.
//!
//! Between the sorts the choice is by irradiance, too, the local lights taken as one cluster. That is a rough estimate, so that neither sort's share falls below
//! [`FAIR_SHARE`] where both have something to give. (By power alone an environment would take all but a 10⁻⁶ of the
//! samples of a room on a ground of 1 km.)
//!
//! A direction to an infinite light gets the radiance and density of all of them together: a sun's disk lies in front
//! of an environment, and either draw can find both.

use std::f32::consts::PI;

use glam::{Vec2, Vec3};

use super::{Environment, EnvironmentSample, Punctual, Shape, Sun, luminance, tree::Tree};
use crate::{
    sampling::distribution::{Discrete, ONE_MINUS_EPSILON},
    world,
};

/// The least share of the samples that infinite lights get beside local ones, and local beside infinite: at worst
/// the needless part of the samples costs a third as many again, and the neglected lights get a quarter of all.
pub const FAIR_SHARE: f32 = 0.25;

/// A light as the compile step describes it.
#[derive(Clone, Debug)]
pub enum Emitter {
    /// An emissive surface. `power` is an estimate of its luminous power in W (π × area × luminance for each side that
    /// emits): it steers the choice, the picture's mean does not depend on it, but a surface of power 0 is never
    /// chosen. Light leaves the front; the back too where `two_sided`.
    Surface {
        object: u32,
        primitive: u32,
        shape: Shape,
        power: f32,
        two_sided: bool,
    },
    Punctual(world::Light),
}

/// Light that arrives at a point.
#[derive(Clone, Copy, Debug)]
pub struct LightSample {
    /// Towards the light, unit.
    pub wi: Vec3,
    /// Metres; infinite for the environment and suns.
    pub distance: f32,
    /// Probability of the choice × solid-angle density, sr⁻¹; the probability alone where `delta`.
    pub pdf: f32,
    /// No BSDF sample can find this light: its MIS weight is 1.
    pub delta: bool,
    pub source: Source,
}

/// How much arrives.
#[derive(Clone, Copy, Debug)]
pub enum Source {
    /// W·m⁻²·sr⁻¹; for deltas the irradiance on a surface that faces it, W/m².
    Radiance(Vec3),
    /// What the surface's material emits from `point` towards the reference point. `uv`: barycentrics (b1, b2) of a
    /// triangle, (a, b) of a quad, (0, 0) on a sphere.
    Surface { object: u32, primitive: u32, point: Vec3, normal: Vec3, uv: Vec2 },
}

#[derive(Clone, Debug)]
pub struct Lights {
    environment: Environment,
    suns: Vec<Sun>,
    /// Over the environment (0) and the suns (from 1); None where there is no light from afar.
    infinite: Option<Discrete>,
    local: Vec<Local>,
    tree: Option<Tree>,
    /// Emitter index to index in `local`, [`NOT_LOCAL`] for suns and for what is never chosen.
    local_of_emitter: Vec<u32>,
}

const NOT_LOCAL: u32 = u32::MAX;

#[derive(Clone, Copy, Debug)]
enum Local {
    Surface { object: u32, primitive: u32, shape: Shape, two_sided: bool },
    Punctual(Punctual),
}

impl Lights {
    pub fn new(emitters: &[Emitter], environment: Environment) -> Self {
        let mut suns = Vec::new();
        let mut local = Vec::new();
        let mut clusters = Vec::new();
        let mut local_of_emitter = vec![NOT_LOCAL; emitters.len()];
        for (emitter, index) in emitters.iter().zip(&mut local_of_emitter) {
            let (light, cluster) = match *emitter {
                Emitter::Surface { object, primitive, shape, power, two_sided } => {
                    let power = if shape.area() > 0.0 { power } else { 0.0 };
                    let light = Local::Surface { object, primitive, shape, two_sided };
                    (light, shape.cluster(power, two_sided))
                }
                Emitter::Punctual(world::Light::Point { position, intensity }) => {
                    let light = Punctual::point(position, intensity);
                    (Local::Punctual(light), light.cluster())
                }
                Emitter::Punctual(world::Light::Spot { position, direction, intensity, inner, outer }) => {
                    let light = Punctual::spot(position, direction, intensity, inner, outer);
                    (Local::Punctual(light), light.cluster())
                }
                Emitter::Punctual(world::Light::Sun { direction, irradiance, angle }) => {
                    suns.push(Sun::new(direction, irradiance, angle));
                    continue;
                }
            };
            if cluster.is_usable() {
                *index = local.len() as u32;
                local.push(light);
                clusters.push(cluster);
            }
        }
        let sky = PI * environment.mean_luminance();
        let infinite =
            Discrete::new(std::iter::once(sky).chain(suns.iter().map(|sun| luminance(sun.irradiance))));
        let tree = Tree::new(&clusters);
        Self { environment, suns, infinite, local, tree, local_of_emitter }
    }

    /// What camera rays see (where it is visible): the environment without the suns' disks.
    pub fn environment(&self) -> &Environment {
        &self.environment
    }

    /// Light from one of the lights at `p`. `None` where the one chosen gives nothing there, or there is none.
    pub fn sample(&self, p: Vec3, u_select: f32, u: Vec2) -> Option<LightSample> {
        let share = self.infinite_share(p);
        if u_select < share {
            self.sample_infinite(u_select / share, u, share)
        } else {
            let u_select = ((u_select - share) / (1.0 - share)).min(ONE_MINUS_EPSILON);
            self.sample_local(p, u_select, u, 1.0 - share)
        }
    }

    /// The density with which [`sample`](Self::sample) finds `point` on a surface from `p`: what a BSDF sample that
    /// hits it is weighted against. `emitter` is its index in the list given to [`new`](Self::new).
    pub fn pdf_surface(&self, emitter: u32, p: Vec3, point: Vec3) -> f32 {
        let index = self.local_of_emitter.get(emitter as usize).copied().unwrap_or(NOT_LOCAL) as usize;
        let (Some(Local::Surface { shape, two_sided, .. }), Some(tree)) = (self.local.get(index), &self.tree)
        else {
            return 0.0;
        };
        if !two_sided && shape.normal(point).dot(p - point) <= 0.0 {
            return 0.0;
        }
        (1.0 - self.infinite_share(p)) * tree.probability(p, index) * shape.pdf(p, point)
    }

    /// The density with which [`sample`](Self::sample) finds `direction` to the environment or a sun's disk from `p`.
    pub fn pdf_escaped(&self, p: Vec3, direction: Vec3) -> f32 {
        self.infinite_share(p) * self.infinite_pdf(direction, self.environment.pdf(direction))
    }

    /// What a ray that leaves the scene meets: the environment and the suns' disks.
    pub fn escaped_radiance(&self, direction: Vec3) -> Vec3 {
        self.environment.radiance(direction) + self.disks(direction)
    }

    fn disks(&self, direction: Vec3) -> Vec3 {
        self.suns.iter().map(|sun| sun.radiance(direction)).sum()
    }

    /// Of a direction among the infinite lights, where the environment's own density is known.
    fn infinite_pdf(&self, direction: Vec3, environment_pdf: f32) -> f32 {
        let Some(infinite) = &self.infinite else { return 0.0 };
        let sun_pdf = |(i, sun): (usize, &Sun)| infinite.probability(i + 1) * sun.pdf(direction);
        infinite.probability(0) * environment_pdf + self.suns.iter().enumerate().map(sun_pdf).sum::<f32>()
    }

    fn infinite_share(&self, p: Vec3) -> f32 {
        let local = self.tree.as_ref().map_or(0.0, |tree| tree.irradiance(p));
        match &self.infinite {
            None => 0.0,
            Some(_) if local <= 0.0 => 1.0,
            Some(infinite) => {
                let infinite = infinite.total() as f32;
                (infinite / (infinite + local)).clamp(FAIR_SHARE, 1.0 - FAIR_SHARE)
            }
        }
    }

    fn sample_infinite(&self, u_select: f32, u: Vec2, share: f32) -> Option<LightSample> {
        let choice = self.infinite.as_ref()?.sample(u_select);
        let sun = choice.index.checked_sub(1).and_then(|i| self.suns.get(i));
        let distance = f32::INFINITY;
        let s = match sun {
            Some(sun) if sun.is_delta() => {
                let (wi, pdf) = (sun.to_sun, share * choice.probability);
                let source = Source::Radiance(sun.irradiance);
                return Some(LightSample { wi, distance, pdf, delta: true, source });
            }
            Some(sun) => {
                let wi = sun.sample(u);
                let (radiance, pdf) = (self.environment.radiance(wi), self.environment.pdf(wi));
                EnvironmentSample { wi, radiance, pdf }
            }
            None => self.environment.sample(u)?,
        };
        let pdf = share * self.infinite_pdf(s.wi, s.pdf);
        let source = Source::Radiance(s.radiance + self.disks(s.wi));
        (pdf > 0.0 && pdf.is_finite()).then_some(LightSample {
            wi: s.wi,
            distance,
            pdf,
            delta: false,
            source,
        })
    }

    fn sample_local(&self, p: Vec3, u_select: f32, u: Vec2, share: f32) -> Option<LightSample> {
        let (index, probability) = self.tree.as_ref()?.sample(p, u_select)?;
        let selection = share * probability;
        match self.local.get(index)? {
            Local::Punctual(light) => {
                let incident = light.sample(p)?;
                Some(LightSample {
                    wi: incident.wi,
                    distance: incident.distance,
                    pdf: selection,
                    delta: true,
                    source: Source::Radiance(incident.radiance),
                })
            }
            &Local::Surface { object, primitive, shape, two_sided } => {
                let s = shape.sample(p, u)?;
                let to_light = s.point - p;
                if !two_sided && s.normal.dot(to_light) >= 0.0 {
                    return None;
                }
                let distance = to_light.length();
                let (wi, pdf) = (to_light / distance, selection * s.pdf);
                let source =
                    Source::Surface { object, primitive, point: s.point, normal: s.normal, uv: s.uv };
                (pdf > 0.0 && pdf.is_finite() && wi.is_finite()).then_some(LightSample {
                    wi,
                    distance,
                    pdf,
                    delta: false,
                    source,
                })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        light::{Quad, Sphere, Triangle},
        sampling::{
            stats::{chi2_test, r3},
            warp::uniform_sphere,
        },
        world::{EnvironmentKind, Light},
    };

    fn environment(bottom: f32, top: f32) -> Environment {
        let kind = EnvironmentKind::Gradient { bottom: Vec3::splat(bottom), top: Vec3::splat(top) };
        Environment::new(&world::Environment { kind, strength: 1.0, rotation: 0.0, visible: true }, &[])
    }

    fn black() -> Environment {
        environment(0.0, 0.0)
    }

    fn surface(shape: Shape, power: f32) -> Emitter {
        Emitter::Surface { object: 3, primitive: 5, shape, power, two_sided: false }
    }

    fn sphere(center: Vec3, radius: f32) -> Shape {
        Shape::Sphere(Sphere { center, radius })
    }

    /// Irradiance at `p` on a surface of normal `n`, where every surface emits a radiance of 1.
    fn irradiance(lights: &Lights, p: Vec3, n: Vec3) -> f32 {
        let count = 1 << 19;
        let mut sum = 0.0;
        for i in 0..count {
            let [a, b, c] = r3(i);
            let Some(s) = lights.sample(p, a, Vec2::new(b, c)) else { continue };
            let radiance = match s.source {
                Source::Radiance(radiance) => radiance.x,
                Source::Surface { .. } => 1.0,
            };
            sum += (radiance * s.wi.dot(n).max(0.0) / s.pdf) as f64;
        }
        (sum / count as f64) as f32
    }

    #[track_caller]
    fn assert_close(found: f32, expected: f32) {
        assert!((found / expected - 1.0).abs() < 3e-3, "{found}, not {expected}");
    }

    #[test]
    fn a_sphere_gives_its_solid_angle() {
        for (center, radius) in [(Vec3::new(1.0, 2.0, 0.5), 0.5), (Vec3::new(0.0, 2.0, 0.0), 1.9)] {
            let lights = Lights::new(&[surface(sphere(center, radius), 1.0)], black());
            let d = center.length();
            assert_close(irradiance(&lights, Vec3::ZERO, Vec3::Y), PI * (radius / d).powi(2) * center.y / d);
        }
    }

    #[test]
    fn a_disk_gives_its_form_factor() {
        let (h, r) = (1.5, 0.8);
        let disk =
            Quad::new(Vec3::new(-r, h, -r), Vec3::new(2.0 * r, 0.0, 0.0), Vec3::new(0.0, 0.0, 2.0 * r), true);
        // u × v points down: −Y.
        let lights = Lights::new(&[surface(Shape::Quad(disk), 2.0)], black());
        assert_close(irradiance(&lights, Vec3::ZERO, Vec3::Y), PI * r * r / (r * r + h * h));
        let above = Vec3::new(0.0, 2.0 * h, 0.0);
        assert_eq!(irradiance(&lights, above, Vec3::NEG_Y), 0.0, "nothing leaves the back");
    }

    #[test]
    fn a_square_gives_its_form_factor_whole_and_in_two_triangles() {
        // A unit square, 1 above the corner under which the receiver lies (Howell, configuration B-3), with X = Y = 1.
        let expected = (1.0 / 2.0f32.sqrt()) * (1.0 / 2.0f32.sqrt()).atan();
        let [o, u, v] = [Vec3::Y, Vec3::X, Vec3::Z];
        let square = Shape::Quad(Quad::new(o, u, v, false));
        let triangles =
            [[o, o + u, o + u + v], [o, o + u + v, o + v]].map(|t| Shape::Triangle(Triangle::new(t, false)));
        for shapes in [vec![square], triangles.to_vec()] {
            let emitters: Vec<_> = shapes.iter().map(|&s| surface(s, 1.0)).collect();
            assert_close(irradiance(&Lights::new(&emitters, black()), Vec3::ZERO, Vec3::Y), expected);
        }
    }

    #[test]
    fn points_and_suns_give_what_they_say() {
        let point = Light::Point { position: Vec3::new(0.0, 2.0, 0.0), intensity: Vec3::splat(8.0) };
        let soft = Light::Sun { direction: Vec3::NEG_Y, irradiance: Vec3::splat(3.0), angle: 0.3 };
        let hard = Light::Sun {
            direction: Vec3::new(0.0, -1.0, 1.0),
            irradiance: Vec3::splat(2.0f32.sqrt()),
            angle: 0.0,
        };
        let only = |light: &Light| Lights::new(&[Emitter::Punctual(light.clone())], black());
        for (light, expected) in [(&point, 2.0), (&soft, 3.0), (&hard, 1.0)] {
            assert_close(irradiance(&only(light), Vec3::ZERO, Vec3::Y), expected);
        }
        let all = [point, soft, hard].map(Emitter::Punctual);
        assert_close(irradiance(&Lights::new(&all, black()), Vec3::ZERO, Vec3::Y), 6.0);
        assert_close(irradiance(&Lights::new(&all, environment(1.0, 1.0)), Vec3::ZERO, Vec3::Y), 6.0 + PI);
    }

    #[test]
    fn a_mixture_gives_the_sum() {
        let (emitters, _) = mixture();
        let lights = Lights::new(&emitters, environment(0.2, 0.2));
        let expected = PI * 0.2 + PI * 0.25 / 4.0 + PI * 0.01 / 9.0 + 8.0;
        assert_close(irradiance(&lights, Vec3::ZERO, Vec3::Y), expected);
    }

    /// Two spheres above and below, one without power, a sun with a wide disk; and where the surfaces are.
    fn mixture() -> (Vec<Emitter>, [(u32, Vec3, f32); 3]) {
        let surfaces =
            [(0, Vec3::new(0.0, 2.0, 0.0), 0.5), (1, Vec3::new(0.0, 3.0, 0.0), 0.1), (3, -Vec3::Y, 0.3)];
        let sun = Light::Sun { direction: -Vec3::Y, irradiance: Vec3::splat(8.0), angle: 1.0 };
        let lamp = |i: usize, power| surface(sphere(surfaces[i].1, surfaces[i].2), power);
        (vec![lamp(0, 1.0), lamp(1, 0.4), Emitter::Punctual(sun), lamp(2, 0.7)], surfaces)
    }

    #[test]
    fn directions_follow_the_densities_of_all_lights_together() {
        let (emitters, surfaces) = mixture();
        let lights = Lights::new(&emitters, environment(0.5, 1.0));
        let p = Vec3::new(1.0, 0.5, 0.2);
        chi2_test(
            "mixture",
            |[a, b, c]| lights.sample(p, a, Vec2::new(b, c)).map(|s| s.wi),
            |w| {
                let through = |&(emitter, center, radius): &(u32, Vec3, f32)| {
                    let along = (center - p).dot(w);
                    let near = radius * radius - (p + along * w).distance_squared(center);
                    (along > 0.0 && near >= 0.0)
                        .then(|| lights.pdf_surface(emitter, p, p + (along - near.sqrt()) * w))
                };
                lights.pdf_escaped(p, w) + surfaces.iter().filter_map(through).sum::<f32>()
            },
        );
    }

    #[test]
    fn a_sample_carries_the_density_that_is_asked_for_later() {
        let (emitters, _) = mixture();
        let lights = Lights::new(&emitters, environment(0.5, 1.0));
        let mut found = [0; 2];
        for i in 0..2000 {
            let [a, b, c] = r3(i);
            let p = 3.0 * uniform_sphere(Vec2::new(c, a));
            let Some(s) = lights.sample(p, a, Vec2::new(b, c)) else { continue };
            let pdf = match s.source {
                Source::Radiance(radiance) => {
                    assert_eq!(radiance, lights.escaped_radiance(s.wi));
                    lights.pdf_escaped(p, s.wi)
                }
                Source::Surface { point, object, primitive, .. } => {
                    assert_eq!((object, primitive), (3, 5));
                    assert!(point.abs_diff_eq(p + s.distance * s.wi, 1e-5));
                    [0, 1, 3]
                        .into_iter()
                        .map(|e| lights.pdf_surface(e, p, point))
                        .min_by(|a, b| (a - s.pdf).abs().total_cmp(&(b - s.pdf).abs()))
                        .expect("three surfaces")
                }
            };
            found[matches!(s.source, Source::Surface { .. }) as usize] += 1;
            assert!((pdf / s.pdf - 1.0).abs() < 1e-3, "{pdf}, drawn with {}", s.pdf);
        }
        assert!(found[0] > 400 && found[1] > 400, "{found:?}");
    }

    #[test]
    fn among_many_lamps_the_tree_beats_a_choice_by_power() {
        // 300 equal lamps over a floor of 16 m: the second moment of one sample, in closed form.
        let lamps: Vec<(Vec3, f32)> = (0..300)
            .map(|i| {
                let [x, y, z] = r3(i);
                (Vec3::new(16.0 * x - 8.0, 0.2 + 2.8 * y, 16.0 * z - 8.0), 0.04)
            })
            .collect();
        let emitters: Vec<_> = lamps.iter().map(|&(c, r)| surface(sphere(c, r), 1.0)).collect();
        let lights = Lights::new(&emitters, black());
        let (mut tree, mut by_power, mut ideal) = (0.0, 0.0, 0.0);
        for i in 0..100 {
            let [x, z, _] = r3(i + 900);
            let p = Vec3::new(16.0 * x - 8.0, 0.0, 16.0 * z - 8.0);
            let mut total = 0.0;
            for (emitter, &(center, radius)) in (0..).zip(&lamps) {
                let d = center - p;
                let e = PI * radius * radius * d.y / d.length().powi(3);
                let shape = sphere(center, radius);
                let point = center - radius * d.normalize();
                let probability = lights.pdf_surface(emitter, p, point) / shape.pdf(p, point);
                tree += e * e / probability;
                by_power += e * e * lamps.len() as f32;
                total += e;
            }
            ideal += total * total;
        }
        let [tree, by_power] = [tree, by_power].map(|moment| moment / ideal - 1.0);
        assert!(tree < 0.05 * by_power, "relative variance {tree}, by power {by_power}");
    }

    #[test]
    fn what_has_no_power_is_never_chosen() {
        let flat = Shape::Triangle(Triangle::new([Vec3::ZERO; 3], false));
        let dark = [
            surface(sphere(Vec3::Y, 0.5), 0.0),
            surface(sphere(Vec3::Y, 0.5), f32::NAN),
            surface(flat, 1.0),
            Emitter::Punctual(Light::Point { position: Vec3::Y, intensity: Vec3::ZERO }),
            Emitter::Punctual(Light::Sun { direction: Vec3::NEG_Y, irradiance: Vec3::ZERO, angle: 0.1 }),
        ];
        let lights = Lights::new(&dark, black());
        for i in 0..100 {
            let [a, b, c] = r3(i);
            assert!(lights.sample(Vec3::ZERO, a, Vec2::new(b, c)).is_none());
        }
        for emitter in 0..9 {
            assert_eq!(lights.pdf_surface(emitter, Vec3::ZERO, Vec3::Y), 0.0);
        }
        assert_eq!(lights.pdf_escaped(Vec3::ZERO, Vec3::Y), 0.0);
    }
}
