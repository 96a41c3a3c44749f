//! Light from infinitely far away, by direction: a colour, a gradient or an image, ready to be looked up and drawn
//! from in proportion to its luminance.
//!
//! | kind | radiance | density, sr⁻¹ |
//! |---|---|---|
//! | colour | the same everywhere | 1 / 4π |
//! | gradient | lerp(bottom, top, t), t = (y + 1) / 2 | luminance / (4π mean luminance): linear in t, so a closed form |
//! | image | bilinear | bilinear luminance × (mean sin θ of the row) / sin θ, normalised |
//!
//! `rotation` turns the environment about +Y, counter-clockwise seen from above (+Y towards the viewer), radians: what
//! is seen towards +X without it is seen towards −Z at a quarter turn. A Mapping node of type Point in Blender turns
//! the *lookup* instead: its Rotation Z of r is a `rotation` of −r here.

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};

use super::map::Map;
use crate::{color::luminance, sampling::distribution::linear, world};

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
    Gradient { bottom: Vec3, top: Vec3 },
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
            world::EnvironmentKind::Gradient { bottom, top } => {
                (Kind::Gradient { bottom: usable(bottom * strength), top: usable(top * strength) }, 0)
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
            Kind::Gradient { bottom, top } => bottom.lerp(*top, height(direction)),
            Kind::Map(map) => map.radiance(direction),
        }
    }

    /// A direction in proportion to its luminance; `None` where the environment is black.
    pub fn sample(&self, u: Vec2) -> Option<EnvironmentSample> {
        let z = match &self.kind {
            Kind::Color(_) => u.x,
            Kind::Gradient { bottom, top } => linear(u.x, luminance(*bottom), luminance(*top)),
            Kind::Map(map) => return map.sample(u),
        };
        let r = 2.0 * (z * (1.0 - z)).max(0.0).sqrt();
        let (sin, cos) = (TAU * u.y).sin_cos();
        let wi = Vec3::new(r * cos, 2.0 * z - 1.0, r * sin);
        let pdf = self.pdf(wi);
        (pdf > 0.0).then(|| EnvironmentSample { wi, radiance: self.radiance(wi), pdf })
    }

    /// Solid-angle density of [`sample`](Self::sample), sr⁻¹.
    pub fn pdf(&self, direction: Vec3) -> f32 {
        match &self.kind {
            Kind::Color(_) | Kind::Gradient { .. } => {
                let mean = self.mean_luminance();
                if mean > 0.0 { luminance(self.radiance(direction)) / mean / (4.0 * PI) } else { 0.0 }
            }
            Kind::Map(map) => map.pdf(direction),
        }
    }

    /// Over the whole sphere, W·m⁻²·sr⁻¹.
    pub fn mean_luminance(&self) -> f32 {
        match &self.kind {
            Kind::Color(color) => luminance(*color),
            Kind::Gradient { bottom, top } => 0.5 * (luminance(*bottom) + luminance(*top)),
            Kind::Map(map) => map.mean_luminance(),
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
            ("color", EnvironmentKind::Color(Vec3::new(0.2, 0.5, 1.0))),
            ("gradient", gradient(Vec3::ONE, Vec3::new(0.5, 0.7, 1.0))),
            ("gradient from black", gradient(Vec3::ZERO, Vec3::new(0.5, 0.7, 1.0))),
            ("image", image(0)),
        ] {
            let environment = environment(kind);
            let sample = |[a, b, _]: [f32; 3]| environment.sample(Vec2::new(a, b));
            chi2_test(name, |u| sample(u).map(|s| s.wi), |w| environment.pdf(w));
            let mean = integrate_sphere(|w| luminance(environment.radiance(w))) / (4.0 * PI);
            assert!((environment.mean_luminance() / mean - 1.0).abs() < 0.05, "{name}");
            for i in 0..500 {
                let s = sample(r3(i)).expect("not black");
                assert!(s.wi.is_normalized(), "{name}");
                assert!((environment.pdf(s.wi) / s.pdf - 1.0).abs() < 1e-3, "{name}");
                assert!(environment.radiance(s.wi).abs_diff_eq(s.radiance, 1e-4), "{name}");
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
            assert_eq!((black.pdf(Vec3::X), black.mean_luminance()), (0.0, 0.0));
        }
    }
}
