//! All the lights of a scene: choosing one for a point, and the densities that multiple importance sampling needs.
//!
//! Lights are of two sorts. *Infinite* ones (the environment and suns) light every point alike: among them the
//! choice is by the irradiance each could give, for the environment π × the mean of what is drawn of it. *Local* ones (surfaces, points,
//! spots) are chosen by a [tree](super::tree), for the irradiance they could give at the point.
//!
//! Between the sorts the choice is by irradiance, too, the local lights taken as one cluster. That is a rough estimate,
//! so that neither sort's share falls below [`FAIR_SHARE`] where both have something to give. (By power alone an
//! environment would take all but a 10⁻⁶ of the samples of a room on a ground of 1 km.)
//!
//! A direction to an infinite light gets the radiance and density of all of them together: a sun's disk lies in front
//! of an environment, and either draw can find both.

use std::f32::consts::PI;

use glam::{Vec2, Vec3};

use super::{Environment, EnvironmentSample, Punctual, Receiver, Shape, Sun, tree::Tree};
use crate::{
    color::luminance,
    sampling::distribution::{Discrete, ONE_MINUS_EPSILON},
    world,
};

/// The least share of the samples that infinite lights get beside local ones, and local beside infinite: at worst
/// the needless part of the samples costs a third as many again, and the neglected lights get a quarter of all.
pub const FAIR_SHARE: f32 = 0.25;

/// How much likelier a light that matters is chosen by a receiver that is known: among 300 lamps over matte and metal
/// balls anything from 4 to 16 is as good, and 1 has half as much noise again.
const EMPHASIS: f32 = 8.0;

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
    /// What the densities of other strategies are weighed against, sr⁻¹; see [`Lights::mis_pdf_surface`].
    pub mis_pdf: f32,
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
        let sky = PI * environment.mean_excess();
        let infinite =
            Discrete::new(std::iter::once(sky).chain(suns.iter().map(|sun| luminance(sun.irradiance))));
        let tree = Tree::new(&clusters);
        Self { environment, suns, infinite, local, tree, local_of_emitter }
    }

    /// What camera rays see (where it is visible): the environment without the suns' disks.
    pub fn environment(&self) -> &Environment {
        &self.environment
    }

    /// Whether the choice depends on the surface that is lit: not where there is nothing to choose.
    pub fn heeds_receivers(&self) -> bool {
        self.local.len() > 1
    }

    /// Whether most light at `p` comes from infinitely far away, roughly.
    pub fn are_mostly_far(&self, p: Vec3) -> bool {
        self.infinite_share(p) > 0.5
    }

    /// Light from one of the lights at `p`. `None` where the one chosen gives nothing there, or there is none.
    pub fn sample(&self, p: Vec3, receiver: &Receiver, u_select: f32, u: Vec2) -> Option<LightSample> {
        let share = self.infinite_share(p);
        if u_select < share {
            self.sample_infinite(u_select / share, u, share)
        } else {
            let u_select = ((u_select - share) / (1.0 - share)).min(ONE_MINUS_EPSILON);
            self.sample_local(p, receiver, u_select, u, 1.0 - share)
        }
    }

    /// The density with which [`sample`](Self::sample) finds `point` on a surface from `p` for a receiver of which nothing
    /// is known. `emitter` is its index in the list given to [`new`](Self::new).
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

    /// [`pdf_surface`](Self::pdf_surface) as a weight in multiple importance sampling. Among several lights the choice is
    /// better than that density tells, which knows nothing of the receiver; how much better, the weights need not know exactly.
    pub fn mis_pdf_surface(&self, emitter: u32, p: Vec3, point: Vec3) -> f32 {
        self.emphasis() * self.pdf_surface(emitter, p, point)
    }

    fn emphasis(&self) -> f32 {
        if self.heeds_receivers() { EMPHASIS } else { 1.0 }
    }

    /// What a ray from `p` that leaves the scene meets, the environment and the suns' disks, and the density with which
    /// [`sample`](Self::sample) finds that direction.
    pub fn escaped(&self, p: Vec3, direction: Vec3) -> (Vec3, f32) {
        let (radiance, pdf) = self.environment.look(direction);
        (radiance + self.disks(direction), self.infinite_share(p) * self.infinite_pdf(direction, pdf))
    }

    fn disks(&self, direction: Vec3) -> Vec3 {
        self.suns.iter().map(|sun| sun.radiance(direction)).sum()
    }

    /// Of a direction among the infinite lights, where the environment's own density is known.
    fn infinite_pdf(&self, direction: Vec3, environment_pdf: f32) -> f32 {
        let Some(infinite) = &self.infinite else { return 0.0 };
        if self.suns.is_empty() {
            return environment_pdf;
        }
        let sun_pdf = |(i, sun): (usize, &Sun)| infinite.probability(i + 1) * sun.pdf(direction);
        infinite.probability(0) * environment_pdf + self.suns.iter().enumerate().map(sun_pdf).sum::<f32>()
    }

    fn infinite_share(&self, p: Vec3) -> f32 {
        let Some(infinite) = &self.infinite else { return 0.0 };
        match self.tree.as_ref().map_or(0.0, |tree| tree.irradiance(p)) {
            local if local <= 0.0 => 1.0,
            local => {
                let infinite = infinite.total() as f32;
                (infinite / (infinite + local)).clamp(FAIR_SHARE, 1.0 - FAIR_SHARE)
            }
        }
    }

    fn sample_infinite(&self, u_select: f32, u: Vec2, share: f32) -> Option<LightSample> {
        let infinite = self.infinite.as_ref()?;
        let (sun, probability) = if self.suns.is_empty() {
            (None, 1.0)
        } else {
            let choice = infinite.sample(u_select);
            (choice.index.checked_sub(1).and_then(|i| self.suns.get(i)), choice.probability)
        };
        let distance = f32::INFINITY;
        let s = match sun {
            Some(sun) if sun.is_delta() => {
                let (wi, pdf) = (sun.to_sun, share * probability);
                let source = Source::Radiance(sun.irradiance);
                return Some(LightSample { wi, distance, pdf, mis_pdf: pdf, delta: true, source });
            }
            Some(sun) => {
                let wi = sun.sample(u);
                let (radiance, pdf) = self.environment.look(wi);
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
            mis_pdf: pdf,
            delta: false,
            source,
        })
    }

    fn sample_local(
        &self,
        p: Vec3,
        receiver: &Receiver,
        u_select: f32,
        u: Vec2,
        share: f32,
    ) -> Option<LightSample> {
        let choice = self.tree.as_ref()?.sample(p, receiver, u_select)?;
        let selection = share * choice.probability;
        match self.local.get(choice.light)? {
            Local::Punctual(light) => {
                let incident = light.sample(p)?;
                Some(LightSample {
                    wi: incident.wi,
                    distance: incident.distance,
                    pdf: selection,
                    mis_pdf: selection,
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
                let mis_pdf = self.emphasis() * share * choice.for_any * s.pdf;
                let source =
                    Source::Surface { object, primitive, point: s.point, normal: s.normal, uv: s.uv };
                (pdf > 0.0 && pdf.is_finite() && wi.is_finite()).then_some(LightSample {
                    wi,
                    distance,
                    pdf,
                    mis_pdf,
                    delta: false,
                    source,
                })
            }
        }
    }
}

#[cfg(test)]
mod tests;
