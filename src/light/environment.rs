//! Light from infinitely far away, by direction: a colour, a gradient or an image, ready to be looked up and drawn
//! from in proportion to its luminance.
//!
//! | kind | radiance | excess |
//! |---|---|---|
//! | colour | the same everywhere | ½ |
//! | gradient | lerp(bottom, top, t), t = (y + 1) / 2 | linear in t, cut off at 0: a closed form |
//! | image | bilinear | bilinear between the excess of texels |
//!
//! Drawn from is the excess: what the luminance has above half of its mean. Every direction that a surface scatters to is
//! found by its BSDF's samples, too, which are spread widely where the environment matters: where it is dark they do as
//! well, so that a draw is better spent on what they miss (Karlík, Šik, Vévoda, Skřivan, Křivánek 2019, *MIS
//! Compensation: Optimizing Sampling Techniques in Multiple Importance Sampling*; they subtract the whole mean, which was
//! measured to be worse than half of it where light passes through glass). Among local lights, too, the environment counts by its
//! excess.
//!
//! `rotation` turns the environment about +Y, counter-clockwise seen from above (+Y towards the viewer), radians: what
//! is seen towards +X without it is seen towards −Z at a quarter turn. A Mapping node of type Point in Blender turns
//! the *lookup* instead: its Rotation Z of r is a `rotation` of −r here.

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};

use super::map::Map;
use crate::{color::luminance, sampling::distribution::linear, world};

/// Share of the mean luminance that is not drawn from.
pub(super) const NEGLECTED: f32 = 0.5;

#[derive(Clone, Debug)]
pub struct Environment {
    kind: Kind,
    /// Image texels that were negative or not finite, and were made black.
    pub dropped_texels: usize,
    /// Whether camera rays see it.
    pub visible: bool,
}

#[derive(Clone, Debug)]
enum Kind {
    Color(Vec3),
    Gradient { bottom: Vec3, top: Vec3, excess: Slope },
    Map(Box<Map>),
}

/// A direction drawn from an environment.
#[derive(Clone, Copy, Debug)]
pub struct EnvironmentSample {
    /// Towards where the light comes from.
    pub wi: Vec3,
    pub radiance: Vec3,
    /// Solid-angle density, sr⁻¹; positive and finite.
    pub pdf: f32,
}

impl Environment {
    /// `images` are the ones that the description refers to. Without its image an environment is black.
    pub fn new(environment: &world::Environment, images: &[world::Image]) -> Self {
        let strength = environment.strength;
        let (kind, dropped_texels) = match environment.kind {
            world::EnvironmentKind::Color(color) => (Kind::Color(usable(color * strength)), 0),
            world::EnvironmentKind::Gradient { bottom, top, .. } => {
                let [bottom, top] = [bottom, top].map(|color| usable(color * strength));
                let (low, high) = (luminance(bottom), luminance(top));
                let neglected = NEGLECTED * 0.5 * (low + high);
                let excess = Slope { low: low - neglected, high: high - neglected };
                (Kind::Gradient { bottom, top, excess }, 0)
            }
            world::EnvironmentKind::Image { image, color_space } => images
                .get(image.index())
                .and_then(|image| Map::new(image, color_space, strength, environment.rotation))
                .map_or((Kind::Color(Vec3::ZERO), 0), |(map, dropped)| (Kind::Map(Box::new(map)), dropped)),
        };
        Self { kind, dropped_texels, visible: environment.visible }
    }

    /// `direction` is a unit vector.
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        match &self.kind {
            Kind::Color(color) => *color,
            Kind::Gradient { bottom, top, .. } => bottom.lerp(*top, height(direction)),
            Kind::Map(map) => map.radiance(direction),
        }
    }

    /// A direction in proportion to the excess; `None` where the environment is black.
    pub fn sample(&self, u: Vec2) -> Option<EnvironmentSample> {
        let t = match &self.kind {
            Kind::Color(_) => u.x,
            Kind::Gradient { excess, .. } => excess.sample(u.x),
            Kind::Map(map) => return map.sample(u),
        };
        let r = 2.0 * (t * (1.0 - t)).max(0.0).sqrt();
        let (sin, cos) = (TAU * u.y).sin_cos();
        let wi = Vec3::new(r * cos, 2.0 * t - 1.0, r * sin);
        let (radiance, pdf) = self.look(wi);
        (pdf > 0.0).then_some(EnvironmentSample { wi, radiance, pdf })
    }

    /// Radiance, and the solid-angle density of [`sample`](Self::sample), sr⁻¹.
    pub fn look(&self, direction: Vec3) -> (Vec3, f32) {
        let density = |excess: f32, mean: f32| if mean > 0.0 { excess / mean / (4.0 * PI) } else { 0.0 };
        match &self.kind {
            Kind::Color(color) => (*color, density(1.0, if *color == Vec3::ZERO { 0.0 } else { 1.0 })),
            Kind::Gradient { bottom, top, excess } => {
                let t = height(direction);
                (bottom.lerp(*top, t), density(excess.at(t), excess.mean()))
            }
            Kind::Map(map) => map.look(direction),
        }
    }

    /// Over the whole sphere.
    pub fn mean_excess(&self) -> f32 {
        match &self.kind {
            Kind::Color(color) => (1.0 - NEGLECTED) * luminance(*color),
            Kind::Gradient { excess, .. } => excess.mean(),
            Kind::Map(map) => map.mean_excess(),
        }
    }

    /// Over the whole sphere, W·m⁻²·sr⁻¹.
    pub fn mean_luminance(&self) -> f32 {
        match &self.kind {
            Kind::Color(color) => luminance(*color),
            Kind::Gradient { bottom, top, .. } => 0.5 * (luminance(*bottom) + luminance(*top)),
            Kind::Map(map) => map.mean_luminance(),
        }
    }
}

/// max(0, low + t (high − low)): at least one of both ends is not negative.
#[derive(Clone, Copy, Debug)]
struct Slope {
    low: f32,
    high: f32,
}

impl Slope {
    fn at(self, t: f32) -> f32 {
        (self.low + t * (self.high - self.low)).max(0.0)
    }

    /// Over t in [0, 1].
    fn mean(self) -> f32 {
        let (dark, bright) = (self.low.min(self.high), self.low.max(self.high));
        if dark >= 0.0 { 0.5 * (dark + bright) } else { 0.5 * bright * (bright / (bright - dark)) }
    }

    /// t in proportion to the height of the slope.
    fn sample(self, u: f32) -> f32 {
        let zero = self.low / (self.low - self.high); // where it is cut off
        if self.low < 0.0 {
            zero + (1.0 - zero) * u.sqrt()
        } else if self.high < 0.0 {
            zero * (1.0 - (1.0 - u).sqrt())
        } else {
            linear(u, self.low, self.high)
        }
    }
}

/// t of the gradient.
fn height(direction: Vec3) -> f32 {
    (0.5 * (direction.y + 1.0)).clamp(0.0, 1.0)
}

fn usable(color: Vec3) -> Vec3 {
    if color.is_finite() { color.max(Vec3::ZERO) } else { Vec3::ZERO }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        sampling::stats::{chi2_test, integrate_sphere, r3},
        world::{ColorSpace, EnvironmentKind, Image, ImageId, Texels},
    };

    fn environment(kind: EnvironmentKind) -> Environment {
        let texels = Texels::Rgba8(vec![[255, 128, 0, 255], [10, 20, 30, 255]]);
        let image = Image { name: "test".into(), width: 1, height: 2, texels };
        Environment::new(&world::Environment { kind, strength: 2.0, rotation: 0.5, visible: true }, &[image])
    }

    fn image(index: u32) -> EnvironmentKind {
        EnvironmentKind::Image { image: ImageId(index), color_space: ColorSpace::Srgb }
    }

    fn gradient(bottom: Vec3, top: Vec3) -> EnvironmentKind {
        EnvironmentKind::Gradient { bottom, top }
    }

    #[test]
    fn samples_follow_the_density() {
        for (name, kind) in [
            ("gradient", gradient(Vec3::ONE, Vec3::new(0.5, 0.7, 1.0))),
            ("color", EnvironmentKind::Color(Vec3::new(0.2, 0.5, 1.0))),
            ("gradient to black", gradient(Vec3::new(0.5, 0.7, 1.0), Vec3::ZERO)),
            ("gradient from black", gradient(Vec3::ZERO, Vec3::new(0.5, 0.7, 1.0))),
            ("image", image(0)),
        ] {
            let environment = environment(kind);
            let sample = |[a, b, _]: [f32; 3]| environment.sample(Vec2::new(a, b));
            chi2_test(name, |u| sample(u).map(|s| s.wi), |w| environment.look(w).1);
            let mean = integrate_sphere(|w| luminance(environment.radiance(w))) / (4.0 * PI);
            assert!((environment.mean_luminance() / mean - 1.0).abs() < 0.05, "{name}");
            let excess =
                integrate_sphere(|w| (luminance(environment.radiance(w)) - 0.5 * mean).max(0.0)) / (4.0 * PI);
            // an image is cut off at its texels, before it is interpolated
            let slack = if name == "image" { 1.3 } else { 1.01 };
            assert!((0.99..slack).contains(&(environment.mean_excess() / excess)), "{name}");
            for i in 0..500 {
                let s = sample(r3(i)).expect("not black");
                assert!(s.wi.is_normalized(), "{name}");
                let (radiance, pdf) = environment.look(s.wi);
                assert!((pdf / s.pdf - 1.0).abs() < 1e-3, "{name}");
                assert!(radiance.abs_diff_eq(s.radiance, 1e-4), "{name}");
            }
        }
    }

    #[test]
    fn a_gradient_of_equal_ends_is_a_color() {
        let c = Vec3::new(0.3, 0.6, 0.1);
        let (a, b) = (environment(EnvironmentKind::Color(c)), environment(gradient(c, c)));
        for i in 0..200 {
            let [x, y, _] = r3(i);
            let (a, b) = (a.sample(Vec2::new(x, y)), b.sample(Vec2::new(x, y)));
            let (a, b) = (a.expect("not black"), b.expect("not black"));
            assert!(a.wi.abs_diff_eq(b.wi, 1e-3) && (a.pdf - b.pdf).abs() < 1e-6);
            assert!(a.radiance.abs_diff_eq(b.radiance, 1e-6));
        }
    }

    #[test]
    fn a_gradient_blends_by_height() {
        let sky = environment(gradient(Vec3::ONE, Vec3::new(0.5, 0.7, 1.0)));
        assert_eq!(sky.radiance(Vec3::Y), 2.0 * Vec3::new(0.5, 0.7, 1.0));
        assert_eq!(sky.radiance(Vec3::NEG_Y), Vec3::splat(2.0));
        assert!(sky.radiance(Vec3::X).abs_diff_eq(2.0 * Vec3::new(0.75, 0.85, 1.0), 1e-6));
        assert_eq!(sky.radiance(Vec3::new(0.0, 1.000_001, 0.0)), sky.radiance(Vec3::Y));
    }

    #[test]
    fn black_gives_nothing() {
        for kind in [EnvironmentKind::Color(Vec3::ZERO), gradient(Vec3::ZERO, Vec3::ZERO), image(7)] {
            let black = environment(kind);
            assert!(black.sample(Vec2::splat(0.3)).is_none());
            assert_eq!((black.look(Vec3::X).1, black.mean_luminance()), (0.0, 0.0));
        }
    }
}
