//! `[[light]]`: punctual lights, and emitters with a shape, which become emissive spheres and quads.
//!
//! A radiance L that leaves an area A evenly carries the power Φ = π A L (4π r² for a sphere; both sides counted where
//! both shine). A point's intensity is I = Φ / 4π, and a sphere of radius r that is to look like it from afar has
//! L = I / (π r²).

use std::f32::consts::PI;

use glam::Vec3;

use super::{
    color::Color,
    context::Context,
    primitive::check_edges,
    range::{above, from},
    table::{Keys, table, tagged},
    vector::{Direction, Pair, Triple},
};
use crate::world::{self, ColorInput, Emission, MaterialId, Surface};

tagged! {
    /// A light. Surfaces with emissive materials are lights too.
    enum Light { Point, Spot, Sun, Rect, Disk, SphereLight }
}

table! {
    /// Shines to all sides from a point, or from a small sphere.
    struct Point as "point" {
        /// Metres.
        position: Triple,
        /// W/sr; 1 where power is not given either.
        intensity: Option<f32>; from(0.0),
        /// Instead of intensity: W in all, 4π times the intensity.
        power: Option<f32>; from(0.0),
        /// Multiplies the intensity.
        color: Color = Color::WHITE,
        /// Metres. 0: a point, with sharp shadows. Otherwise a sphere that can be seen.
        radius: f32 = 0.0; from(0.0),
    }
}

table! {
    /// Shines from a point into a cone.
    struct Spot as "spot" {
        /// Metres.
        position: Triple,
        /// Where the light goes.
        direction: Option<Direction>,
        /// Instead of direction: a point on the cone's axis, metres.
        target: Option<Triple>,
        /// W/sr on the axis.
        intensity: f32 = 1.0; from(0.0),
        /// Multiplies the intensity.
        color: Color = Color::WHITE,
        /// Half-angle of the part of full intensity, degrees.
        inner: f32 = 0.0; from(0.0).below(90.0),
        /// Half-angle of the cone, degrees; the light falls off from inner to here.
        outer: f32 = 45.0; above(0.0).to(90.0),
    }
}

table! {
    /// Shines from infinitely far away.
    struct Sun as "sun" {
        /// Where the light goes. Without it: azimuth and elevation.
        direction: Option<Direction>,
        /// Where the sun stands: degrees about +Y from −Z (north), clockwise seen from above; +X (east) is 90.
        azimuth: f32 = 0.0,
        /// Where the sun stands: degrees above the horizon.
        elevation: f32 = 45.0; from(-90.0).to(90.0),
        /// W/m² on a surface that faces it.
        irradiance: f32 = 1.0; from(0.0),
        /// Multiplies the irradiance.
        color: Color = Color::WHITE,
        /// Angular diameter, degrees. 0: sharp shadows; our sun has 0.53.
        angle: f32 = 0.53; from(0.0).to(180.0),
    }
}

table! {
    /// A parallelogram that shines from its front: from origin, u and v (the front is the side of u × v), or from
    /// position, target or direction, and size.
    struct Rect as "rect" {
        /// One corner, metres.
        origin: Option<Triple>,
        /// From that corner along one edge, metres.
        u: Option<Direction>,
        /// From that corner along the other edge, metres.
        v: Option<Direction>,
        /// Instead of origin, u and v: its centre, metres.
        position: Option<Triple>,
        /// With position: the point that it faces, metres.
        target: Option<Triple>,
        /// With position: the direction that it faces, instead of target.
        direction: Option<Direction>,
        /// With position: width and height (one number: both), metres.
        size: Pair = Pair::Same(1.0); above(0.0),
        /// W/m²/sr; 1 where power is not given either.
        radiance: Option<f32>; from(0.0),
        /// Instead of radiance: W in all.
        power: Option<f32>; from(0.0),
        /// Multiplies the radiance.
        color: Color = Color::WHITE,
        /// Whether the back shines too.
        two_sided: bool = false,
    }
}

table! {
    /// A disk that shines from its front.
    struct Disk as "disk" {
        /// Its centre, metres.
        position: Triple,
        /// The point that it faces, metres.
        target: Option<Triple>,
        /// The direction that it faces, instead of target. Without both: down.
        direction: Option<Direction>,
        /// Metres.
        radius: f32 = 0.5; above(0.0),
        /// W/m²/sr; 1 where power is not given either.
        radiance: Option<f32>; from(0.0),
        /// Instead of radiance: W in all.
        power: Option<f32>; from(0.0),
        /// Multiplies the radiance.
        color: Color = Color::WHITE,
        /// Whether the back shines too.
        two_sided: bool = false,
    }
}

table! {
    /// A sphere that shines.
    struct SphereLight as "sphere" {
        /// Metres.
        center: Triple,
        /// Metres.
        radius: f32 = 0.5; above(0.0),
        /// W/m²/sr; 1 where power is not given either.
        radiance: Option<f32>; from(0.0),
        /// Instead of radiance: W in all.
        power: Option<f32>; from(0.0),
        /// Multiplies the radiance.
        color: Color = Color::WHITE,
    }
}

/// What the lights of a file become.
#[derive(Default)]
pub(super) struct Lights {
    pub punctual: Vec<world::Light>,
    pub spheres: Vec<world::Sphere>,
    pub quads: Vec<world::Quad>,
}

impl Lights {
    /// Adds `light`, the `number`th of the file counted from 1; its surface's material goes to `materials`.
    pub fn add(
        &mut self,
        light: Light,
        number: usize,
        materials: &mut Vec<world::Material>,
        cx: &mut Context,
    ) {
        let mut emissive = |radiance: f32, color: Color, two_sided: bool| {
            let emission =
                Emission { color: ColorInput::constant(color.vec()), strength: radiance, two_sided };
            let name = format!("light {number}");
            materials.push(world::Material {
                emission: Some(emission),
                ..world::Material::new(name, Surface::Black)
            });
            MaterialId(materials.len() as u32 - 1)
        };
        match light {
            Light::Point(light) => {
                let intensity = light.intensity(cx);
                if light.radius > 0.0 {
                    let material =
                        emissive(intensity / (PI * light.radius * light.radius), light.color, false);
                    let center = light.position.vec();
                    self.spheres.push(world::Sphere { center, radius: light.radius, material });
                } else {
                    let (position, intensity) = (light.position.vec(), light.color.vec() * intensity);
                    self.punctual.push(world::Light::Point { position, intensity });
                }
            }
            Light::Spot(light) => self.punctual.push(light.resolve(cx)),
            Light::Sun(light) => self.punctual.push(light.resolve(cx)),
            Light::Rect(light) => {
                let [origin, u, v] = light.corner_and_edges(cx);
                let sides = if light.two_sided { 2.0 } else { 1.0 };
                let area = u.as_dvec3().cross(v.as_dvec3()).length() as f32;
                let radiance = radiance(light.radiance, light.power, sides * area, &light.keys, cx);
                let material = emissive(radiance, light.color, light.two_sided);
                self.quads.push(world::Quad { origin, u, v, round: false, material });
            }
            Light::Disk(light) => {
                let facing = facing(light.position, light.target, light.direction, &light.keys, cx);
                let [u, v] = edges(facing, [2.0 * light.radius; 2]);
                let sides = if light.two_sided { 2.0 } else { 1.0 };
                let area = sides * PI * light.radius * light.radius;
                let radiance = radiance(light.radiance, light.power, area, &light.keys, cx);
                let material = emissive(radiance, light.color, light.two_sided);
                let origin = light.position.vec() - (u + v) / 2.0;
                self.quads.push(world::Quad { origin, u, v, round: true, material });
            }
            Light::SphereLight(light) => {
                let area = 4.0 * PI * light.radius * light.radius;
                let radiance = radiance(light.radiance, light.power, area, &light.keys, cx);
                let material = emissive(radiance, light.color, false);
                let (center, radius) = (light.center.vec(), light.radius);
                self.spheres.push(world::Sphere { center, radius, material });
            }
        }
    }
}

/// L = Φ / (π A), where the power is given.
fn radiance(radiance: Option<f32>, power: Option<f32>, area: f32, keys: &Keys, cx: &mut Context) -> f32 {
    keys.exclusive(&["radiance", "power"], cx);
    match power {
        Some(power) => power / (PI * area),
        None => radiance.unwrap_or(1.0),
    }
}

impl Point {
    fn intensity(&self, cx: &mut Context) -> f32 {
        self.keys.exclusive(&["intensity", "power"], cx);
        match self.power {
            Some(power) => power / (4.0 * PI),
            None => self.intensity.unwrap_or(1.0),
        }
    }
}

impl Spot {
    fn resolve(self, cx: &mut Context) -> world::Light {
        if self.keys.sound(&["inner", "outer"]) && self.inner >= self.outer {
            let at = self.keys.value(self.keys.first(&["inner"]).unwrap_or("outer"));
            cx.error(at, format!("`inner` ({}°) must be less than `outer` ({}°)", self.inner, self.outer));
        }
        world::Light::Spot {
            position: self.position.vec(),
            direction: facing(self.position, self.target, self.direction, &self.keys, cx),
            intensity: self.color.vec() * self.intensity,
            inner: self.inner.to_radians(),
            outer: self.outer.to_radians(),
        }
    }
}

impl Sun {
    fn resolve(self, cx: &mut Context) -> world::Light {
        self.keys.exclusive(&["direction", "azimuth"], cx);
        self.keys.exclusive(&["direction", "elevation"], cx);
        let direction = match self.direction {
            Some(direction) => direction.unit(),
            None => {
                let (sin_e, cos_e) = self.elevation.to_radians().sin_cos();
                let (sin_a, cos_a) = self.azimuth.to_radians().sin_cos();
                -Vec3::new(cos_e * sin_a, sin_e, -cos_e * cos_a)
            }
        };
        let (irradiance, angle) = (self.color.vec() * self.irradiance, self.angle.to_radians());
        world::Light::Sun { direction, irradiance, angle }
    }
}

impl Rect {
    fn corner_and_edges(&self, cx: &mut Context) -> [Vec3; 3] {
        let keys = &self.keys;
        let corner = ["origin", "u", "v"];
        let centre = ["position", "target", "direction", "size"];
        if let (Some(by_corner), Some(by_centre)) = (keys.first(&corner), keys.first(&centre)) {
            cx.error(keys.key(by_centre), format!("`{by_centre}` and `{by_corner}` exclude each other"))
                .help("say origin, u and v, or else position, target (or direction) and size");
        } else if keys.first(&corner).is_some() {
            for missing in corner.iter().filter(|name| !keys.given(name) && keys.sound(&[name])) {
                cx.absent(keys.table.clone(), format!("the key `{missing}` is missing"));
            }
        } else if !keys.given("position") && keys.sound(&corner) && keys.sound(&centre) {
            cx.absent(keys.table.clone(), "the light has no place")
                .help("say origin, u and v, or else position, target (or direction) and size");
        }
        if let (Some(u), Some(v)) = (self.u, self.v) {
            check_edges(u.0.into(), v.0.into(), keys.value("v"), cx);
            return [self.origin.unwrap_or(Triple([0.0; 3])).vec(), u.0.into(), v.0.into()];
        }
        let position = self.position.unwrap_or(Triple([0.0; 3]));
        let facing = facing(position, self.target, self.direction, keys, cx);
        let [u, v] = edges(facing, self.size.array());
        [position.vec() - (u + v) / 2.0, u, v]
    }
}

/// The unit direction to `target`, or `direction`, or down.
fn facing(
    position: Triple,
    target: Option<Triple>,
    direction: Option<Direction>,
    keys: &Keys,
    cx: &mut Context,
) -> Vec3 {
    keys.exclusive(&["target", "direction"], cx);
    match (target, direction) {
        (Some(target), _) => {
            let way = target.vec().as_dvec3() - position.vec().as_dvec3();
            way.try_normalize().map(|way| way.as_vec3()).unwrap_or_else(|| {
                if keys.sound(&["position", "target"]) {
                    cx.error(keys.value("target"), "`target` is where the light is: it has no direction");
                }
                Vec3::NEG_Y
            })
        }
        (None, Some(direction)) => direction.unit(),
        (None, None) => Vec3::NEG_Y,
    }
}

/// Edges u and v of these lengths with u × v along `facing`; v is as upright as it can be.
fn edges(facing: Vec3, [width, height]: [f32; 2]) -> [Vec3; 2] {
    let up = if facing.y.abs() > 0.999 { Vec3::NEG_Z } else { Vec3::Y };
    let right = up.cross(facing).normalize();
    [right * width, facing.cross(right) * height]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_face_the_way_they_should() {
        for facing in [Vec3::NEG_Y, Vec3::Y, Vec3::X, Vec3::new(1.0, -2.0, 0.5).normalize()] {
            let [u, v] = edges(facing, [2.0, 3.0]);
            assert!(u.cross(v).abs_diff_eq(6.0 * facing, 1e-5), "{facing}");
            assert!(u.dot(v).abs() < 1e-5);
        }
    }
}
