//! Punctual lights, and the points that stand for lights with area.
//!
//! A `parallel` light of colour c gives a Lambertian surface that faces it the radiance c × albedo: the irradiance
//! is π c. A light with `fade_power 2` and `fade_distance` f is weakened to 2f² / (f² + d²) at distance d, which is
//! 2f² / d² but for f² / d². A spotlight with `tightness` n is weakened to cosⁿ of the angle to its axis, and where
//! `radius` and `falloff` are the same angle, to nothing outside it.

use std::{
    f32::consts::{FRAC_1_PI, TAU},
    fmt::Write,
};

use glam::Vec3;

use super::sdl::{num, num64, rgb, vec3};
use crate::{export::note::Notes, geometry::Frame, world::Light};

/// f, in POV-Ray units. The error is below 1e-6 from a tenth of a unit on.
const FADE: f32 = 1e-4;
/// Parallel lights that a sun with an angle becomes.
const SUN_POINTS: usize = 55;
/// cos inner − cos outer below which the rim of a spot is not resolved by single precision: (this)⁻² × 2⁻²⁴ ≈ 1 %.
const SHARP: f32 = 2.5e-3;
/// Golden angle, radians.
const GOLDEN: f32 = 2.399_963_2;

/// `unit` is POV-Ray units per metre.
pub fn light(light: &Light, subject: &str, unit: f32, notes: &mut Notes) -> String {
    match *light {
        Light::Point { position, intensity } => point(position * unit, intensity * unit * unit),
        Light::Spot { position, direction, intensity, inner, outer } => spot(
            Cone { position: position * unit, direction, inner, outer },
            intensity * unit * unit,
            subject,
            notes,
        ),
        Light::Sun { direction, irradiance, angle } if angle <= 0.0 => parallel(-direction, irradiance),
        Light::Sun { direction, irradiance, angle } => {
            notes.approximated(
                subject,
                format!(
                    "{SUN_POINTS} parallel lights spread over its disk instead of the disk: so many steps across a \
                     penumbra; mirrors and glass do not show the disk"
                ),
            );
            disk_of_suns(-direction, irradiance, angle)
        }
    }
}

/// Light of this irradiance (on what faces it) from far away in direction `towards`.
pub fn parallel(towards: Vec3, irradiance: Vec3) -> String {
    // The distance only has to be outside of everything.
    let position = towards.normalize_or(Vec3::Y) * 1e6;
    format!(
        "light_source {{ {} {} parallel point_at <0,0,0> }}\n",
        vec3(position),
        rgb(irradiance * FRAC_1_PI)
    )
}

fn disk_of_suns(towards: Vec3, irradiance: Vec3, angle: f32) -> String {
    let frame = Frame::from_z(towards.normalize_or(Vec3::Y));
    let cap = 1.0 - (0.5 * angle).cos();
    let mut out = String::new();
    let mut lights = Vec::with_capacity(SUN_POINTS);
    for i in 0..SUN_POINTS {
        let z = 1.0 - cap * (i as f32 + 0.5) / SUN_POINTS as f32;
        let r = (1.0 - z * z).max(0.0).sqrt();
        let (sin, cos) = (GOLDEN * i as f32).sin_cos();
        lights.push(Vec3::new(r * cos, r * sin, z));
    }
    let projected: f32 = lights.iter().map(|w| w.z).sum();
    for w in lights {
        out.push_str(&parallel(frame.to_world(w), irradiance / projected));
    }
    out
}

fn faded(intensity: Vec3) -> Vec3 {
    intensity * (FRAC_1_PI / (2.0 * FADE * FADE))
}

/// `position` in POV-Ray units, `intensity` in W/sr times units² per m².
fn point(position: Vec3, intensity: Vec3) -> String {
    let color = rgb(faded(intensity));
    format!("light_source {{ {} {color} fade_power 2 fade_distance {} }}\n", vec3(position), num(FADE))
}

/// A piece of an emitting surface: shines to the side of `normal`, as the cosine.
pub fn patch(position: Vec3, normal: Vec3, intensity: Vec3) -> String {
    let color = rgb(faded(intensity));
    format!(
        "light_source {{ {} {color} spotlight point_at {} radius 90 falloff 90 tightness 1 fade_power 2 fade_distance \
         {} }}\n",
        vec3(position),
        vec3(position + normal),
        num(FADE)
    )
}

struct Cone {
    position: Vec3,
    direction: Vec3,
    /// Half-angles, radians.
    inner: f32,
    outer: f32,
}

/// Between the two angles the falloff is a parabola in cos θ: three lights with a sharp rim at `outer` add up to it,
/// and three at `inner` take it away again and put 1 there. Negative light is light to POV-Ray.
fn spot(cone: Cone, intensity: Vec3, subject: &str, notes: &mut Notes) -> String {
    let Cone { position, direction, inner, outer } = cone;
    let target = position + direction.normalize_or(Vec3::NEG_Y);
    let one = |angle: f32, tightness: u32, factor: f64| {
        let color = faded(intensity).as_dvec3() * factor;
        let degrees = num64(f64::from(angle).to_degrees());
        format!(
            "light_source {{ {} rgb <{},{},{}> spotlight point_at {} radius {degrees} falloff {degrees} tightness \
             {tightness} fade_power 2 fade_distance {} }}\n",
            vec3(position),
            num64(color.x),
            num64(color.y),
            num64(color.z),
            vec3(target),
            num(FADE)
        )
    };
    let quarter = 0.25 * TAU;
    let (ci, co) = (f64::from(inner).cos(), f64::from(outer).cos());
    let width = ci - co;
    if width < f64::from(SHARP) {
        if outer > inner {
            notes.approximated(
                subject,
                "the rim is sharp, at the angle where the light has fallen to one half",
            );
        }
        let middle = (co + width * 0.5f64.sqrt()).acos() as f32;
        return if outer > inner { one(middle, 0, 1.0) } else { one(outer, 0, 1.0) };
    }
    if outer > quarter {
        notes.approximated(subject, "dark beyond 90° from its axis");
    }
    let k = 1.0 / (width * width);
    let mut out = String::new();
    for (tightness, factor) in [(2, k), (1, -2.0 * k * co), (0, k * co * co)] {
        let _ = write!(out, "{}", one(outer.min(quarter), tightness, factor));
    }
    if inner > 0.0 {
        for (tightness, factor) in [(2, -k), (1, 2.0 * k * co), (0, 1.0 - k * co * co)] {
            let _ = write!(out, "{}", one(inner.min(quarter), tightness, factor));
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(l: &Light, unit: f32) -> (String, usize) {
        let mut notes = Notes::default();
        (light(l, "l", unit, &mut notes), notes.finish().len())
    }

    #[test]
    fn a_sun_of_irradiance_pi_is_a_parallel_light_of_one() {
        let sun =
            Light::Sun { direction: Vec3::NEG_Y, irradiance: Vec3::splat(std::f32::consts::PI), angle: 0.0 };
        assert_eq!(
            written(&sun, 64.0),
            ("light_source { <0.0,1000000.0,0.0> rgb 1.0 parallel point_at <0,0,0> }\n".into(), 0)
        );
    }

    #[test]
    fn a_sharp_spot_is_one_light_and_a_soft_one_six() {
        let spot = |inner, outer| Light::Spot {
            position: Vec3::ZERO,
            direction: Vec3::NEG_Z,
            intensity: Vec3::ONE,
            inner,
            outer,
        };
        let count = |l: &Light| written(l, 1.0).0.matches("light_source").count();
        assert_eq!(count(&spot(0.5, 0.5)), 1);
        assert_eq!(count(&spot(0.3, 0.5)), 6);
        assert_eq!(count(&spot(0.0, 0.5)), 3);
        assert_eq!(written(&spot(0.3, 0.5), 1.0).1, 0, "exact");
        assert_eq!(written(&spot(0.5, 0.501), 1.0).1, 1);
    }

    #[test]
    fn light_grows_with_the_square_of_the_unit() {
        let lamp = Light::Point { position: Vec3::X, intensity: Vec3::ONE };
        let color = |unit| {
            let sdl = written(&lamp, unit).0;
            sdl.split("rgb ")
                .nth(1)
                .and_then(|s| s.split(' ').next())
                .and_then(|s| s.parse::<f32>().ok())
                .expect("rgb")
        };
        assert!((color(8.0) / color(1.0) - 64.0).abs() < 1e-3);
        assert!((color(1.0) * 2.0 * FADE * FADE * std::f32::consts::PI - 1.0).abs() < 1e-5);
    }
}
