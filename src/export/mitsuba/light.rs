//! Emitters without a surface of their own: lamps, suns, the environment.
//!
//! | here | Mitsuba |
//! |---|---|
//! | point, W/sr | `point`, the same |
//! | spot | `spot` with a hard edge; a projected bitmap holds the falloff, which Mitsuba has linear in the angle |
//! | sun of angle 0, W/m² | `directional`, the same |
//! | sun with an angle | a `disk` far away, black but for its front: radiance E / (π sin² α) |
//! | environment image | `envmap` of 2h + 1 rows: its texels lie at the ends of rows, at v = k/2h, where ours lie at (r + ½)/h |
//! | gradient | `envmap` of [`ROWS`] rows |

use std::f32::consts::{FRAC_PI_2, PI};

use glam::{Affine3A, Mat3A, Vec3, Vec3A};

use super::{Exporter, bounds, xml::Node};
use crate::{
    color::srgb_decode,
    export::{Error, bitmap},
    world::{ColorSpace, EnvironmentKind, Image, Light, Texels},
};

/// Of a gradient: linear interpolation between k/(ROWS − 1) errs by at most (π/(ROWS − 1))²/16 of the span, 1.5e-7.
const ROWS: u32 = 2049;
/// Texels along a side of a spot's falloff.
const SPOT: u32 = 1024;
/// A wider cone does not fit the plane its falloff is projected on.
const WIDEST_SPOT: f32 = 85.0;
/// How far away suns are, in radii of the scene: light from them is parallel to a tenth of a milliradian.
const SUN_DISTANCE: f32 = 1e4;
/// A disk cannot span half the sky.
const WIDEST_SUN: f32 = 75.0;

impl Exporter<'_> {
    /// `hidden`: the camera sees no emitters.
    pub fn lights(&mut self, hidden: bool, aspect: f32) -> Result<Vec<Node>, Error> {
        let world = self.world;
        let mut nodes = Vec::new();
        for light in &world.model.lights {
            nodes.push(match *light {
                Light::Point { position, intensity } => Node::plugin("emitter", "point")
                    .child(Node::xyz("point", "position", position))
                    .child(Node::rgb("intensity", intensity)),
                Light::Spot { position, direction, intensity, inner, outer } => {
                    self.spot(position, direction, intensity, inner, outer)?
                }
                Light::Sun { direction, irradiance, angle } => {
                    self.sun(direction.normalize_or(Vec3::NEG_Y), irradiance, angle, hidden, aspect)
                }
            });
        }
        nodes.extend(self.environment(hidden)?);
        Ok(nodes)
    }

    fn spot(
        &mut self,
        position: Vec3,
        direction: Vec3,
        intensity: Vec3,
        inner: f32,
        outer: f32,
    ) -> Result<Node, Error> {
        let z = Vec3A::from(direction.normalize_or(Vec3::NEG_Z));
        let (x, y) = z.any_orthonormal_pair();
        let frame = Affine3A { matrix3: Mat3A::from_cols(x, y, z), translation: position.into() };
        let widest = WIDEST_SPOT.to_radians();
        let edge = outer.min(widest);
        let mut node = Node::plugin("emitter", "spot")
            .child(Node::to_world(frame))
            .child(Node::rgb("intensity", intensity))
            .float("cutoff_angle", edge.to_degrees())
            .float("beam_width", edge.to_degrees());
        if outer > widest {
            self.notes.approximated(
                "",
                format!(
                    "a spot of half-angle {:.1}° ends at {WIDEST_SPOT}°: Mitsuba projects its falloff on a plane",
                    outer.to_degrees()
                ),
            );
        }
        let (cos_inner, cos_outer) = (inner.cos(), outer.cos());
        if cos_inner - cos_outer > 1e-6 {
            self.notes.approximated(
                "",
                format!(
                    "a spot's falloff is a picture of {SPOT} × {SPOT} texels: off by at most (Δ / (cos inner − cos outer))² / 4 and \
                     one texel of rim, Δ = 2 tan outer / {SPOT}"
                ),
            );
            let falloff = |at: f32| {
                let cos = 1.0 / (1.0 + at * at).sqrt();
                ((cos - cos_outer) / (cos_inner - cos_outer)).clamp(0.0, 1.0).powi(2)
            };
            let scale = edge.tan();
            let texel = |i: u32| {
                let middle = |k: u32| (2.0 * (k as f32 + 0.5) / SPOT as f32 - 1.0) * scale;
                [falloff(middle(i % SPOT).hypot(middle(i / SPOT))); 3]
            };
            let texels = Texels::RgbF32((0..SPOT * SPOT).map(texel).collect());
            let image = Image { name: "spot".into(), width: SPOT, height: SPOT, texels };
            let file = self.loose_bitmap("spot", &image)?;
            node = node.child(
                Node::plugin("texture", "bitmap")
                    .named("texture")
                    .string("filename", &file)
                    .boolean("raw", true)
                    .string("wrap_mode", "clamp"),
            );
        }
        Ok(node)
    }

    fn sun(&mut self, direction: Vec3, irradiance: Vec3, angle: f32, hidden: bool, aspect: f32) -> Node {
        let half = (0.5 * angle).clamp(0.0, FRAC_PI_2);
        let sin = half.sin();
        if !(irradiance / (PI * sin * sin)).is_finite() {
            return Node::plugin("emitter", "directional")
                .child(Node::xyz("vector", "direction", direction))
                .child(Node::rgb("irradiance", irradiance));
        }
        let (center, radius) = bounds::sphere(self.world);
        if half.to_degrees() > WIDEST_SUN {
            self.notes.approximated("", format!("a sun is {} ° wide at most", 2.0 * WIDEST_SUN));
        }
        let half = half.min(WIDEST_SUN.to_radians());
        let sin = half.sin();
        if !hidden && self.sees(-direction, half, aspect) {
            self.notes
                .approximated("", "the disk of the sun is in the picture; rayo's camera does not see it");
        }
        let z = Vec3A::from(direction);
        let (x, y) = z.any_orthonormal_pair();
        let distance = SUN_DISTANCE * radius;
        let size = distance * half.tan();
        let frame = Affine3A {
            matrix3: Mat3A::from_cols(size * x, size * y, z),
            translation: Vec3A::from(center - distance * direction),
        };
        Node::plugin("shape", "disk")
            .child(Node::to_world(frame))
            .child(Node::plugin("bsdf", "diffuse").child(Node::rgb("reflectance", Vec3::ZERO)))
            .child(
                Node::plugin("emitter", "area").child(Node::rgb("radiance", irradiance / (PI * sin * sin))),
            )
    }

    /// Whether a cone of half-angle `half` about a direction may reach into the picture.
    fn sees(&self, direction: Vec3, half: f32, aspect: f32) -> bool {
        let camera = &self.world.camera;
        let d = camera.to_world.inverse().transform_vector3(direction);
        let vertical = match camera.projection {
            crate::world::Projection::Perspective { vfov } => (0.5 * vfov).tan(),
            crate::world::Projection::Orthographic { .. } => 0.0,
        };
        let corner = vertical.hypot(vertical * aspect).atan();
        d.angle_between(Vec3::NEG_Z) < corner + half
    }

    fn environment(&mut self, hidden: bool) -> Result<Option<Node>, Error> {
        let environment = &self.world.environment;
        let (image, turn) = match &environment.kind {
            EnvironmentKind::Color(color) => {
                let radiance = environment.strength * *color;
                if radiance == Vec3::ZERO {
                    return Ok(None);
                }
                self.note_visibility(hidden);
                return Ok(Some(Node::plugin("emitter", "constant").child(Node::rgb("radiance", radiance))));
            }
            EnvironmentKind::Gradient { bottom, top } => {
                let row = |k: u32| {
                    let t = 0.5 * ((PI * k as f32 / (ROWS - 1) as f32).cos() + 1.0);
                    (environment.strength * bottom.lerp(*top, t)).to_array()
                };
                let texels = (0..ROWS).flat_map(|k| [row(k); 2]).collect();
                let image =
                    Image { name: "gradient".into(), width: 2, height: ROWS, texels: Texels::RgbF32(texels) };
                (image, 0.0)
            }
            EnvironmentKind::Image { image, color_space } => {
                let image = &self.world.model.images[image.index()];
                (between_rows(image, *color_space, environment.strength), environment.rotation)
            }
        };
        self.note_visibility(hidden);
        let file = self.loose_bitmap("environment", &image)?;
        // Its u is atan2(x, −z) / 2π: a quarter turn from ours.
        let turn = Affine3A::from_rotation_y(turn + FRAC_PI_2);
        Ok(Some(Node::plugin("emitter", "envmap").string("filename", &file).child(Node::to_world(turn))))
    }

    fn note_visibility(&mut self, hidden: bool) {
        if !self.world.environment.visible && !hidden {
            self.notes.approximated(
                "",
                "the camera sees the environment: Mitsuba hides all emitters from it or none, and others are to be seen",
            );
        }
    }

    fn loose_bitmap(&mut self, name: &str, image: &Image) -> Result<String, Error> {
        let bitmap = bitmap::as_stored(image)?;
        let name = self.names.unique("t", name);
        let file = format!("textures/{name}.{}", bitmap.extension);
        self.out.write(&file, &bitmap.bytes)?;
        Ok(file)
    }
}

/// Rows at v = k/2h: the odd ones are the image's, the even ones the means of their neighbours, the first and last the
/// poles. Bilinear between them is what rayo sees.
fn between_rows(image: &Image, space: ColorSpace, strength: f32) -> Image {
    let (width, height) = (image.width as usize, image.height as usize);
    let decode = |c: f32| if space == ColorSpace::Srgb { srgb_decode(c) } else { c };
    let texel = |x: usize, y: usize| {
        let i = y * width + x;
        let stored = match &image.texels {
            Texels::Rgba8(t) => t.get(i).map(|&[r, g, b, _]| [r, g, b].map(|c| decode(c as f32 / 255.0))),
            Texels::Rgba16(t) => t.get(i).map(|&[r, g, b, _]| [r, g, b].map(|c| decode(c as f32 / 65535.0))),
            Texels::RgbF32(t) => t.get(i).copied(),
        };
        let color = strength * Vec3::from(stored.unwrap_or_default());
        if color.is_finite() && color.min_element() >= 0.0 { color } else { Vec3::ZERO }
    };
    let columns = width.max(2);
    let rows = 2 * height + 1;
    let mut texels = Vec::with_capacity(columns * rows);
    for k in 0..rows {
        let (above, below) = (k.saturating_sub(1) / 2, (k / 2).min(height.saturating_sub(1)));
        for x in 0..columns {
            let x = x.min(width.saturating_sub(1));
            texels.push((0.5 * (texel(x, above) + texel(x, below))).to_array());
        }
    }
    let texels = Texels::RgbF32(texels);
    Image { name: image.name.clone(), width: columns as u32, height: rows as u32, texels }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn odd_rows_are_the_image_and_even_ones_lie_between() {
        let texels = Texels::RgbF32(vec![[1.0; 3], [2.0; 3], [5.0; 3], [6.0; 3]]);
        let image = Image { name: String::new(), width: 2, height: 2, texels };
        let finer = between_rows(&image, ColorSpace::Linear, 2.0);
        let Texels::RgbF32(texels) = finer.texels else { panic!("not float") };
        let first: Vec<f32> = texels.iter().step_by(2).map(|t| t[0]).collect();
        assert_eq!((finer.width, finer.height), (2, 5));
        assert_eq!(first, [2.0, 2.0, 6.0, 10.0, 10.0]);
    }
}
