//! The sensor, and how its picture is made.
//!
//! Mitsuba's cameras look along +Z with +X to the left: ours, turned by half about Y. Their lens is given by its radius, and an
//! orthographic one spans 2 units of its frame in width.

use glam::{Affine3A, Vec3};

use super::{Exporter, xml::Node};
use crate::{
    render::{FilterKind, Settings},
    world::Projection,
};

/// What lies nearer to the camera is not seen, m.
const NEAR: f32 = 1e-4;
const FAR: f32 = 1e18;

impl Exporter<'_> {
    pub fn sensor(&mut self, settings: &Settings) -> Node {
        let camera = &self.world.camera;
        let turn = Affine3A::from_scale(Vec3::new(-1.0, 1.0, -1.0));
        let to_world = camera.to_world * turn;
        let [width, height] = settings.size;
        let node = match camera.projection {
            Projection::Perspective { vfov } => {
                let kind = if camera.aperture > 0.0 { "thinlens" } else { "perspective" };
                let node = Node::plugin("sensor", kind)
                    .string("fov_axis", "y")
                    .float("fov", vfov.to_degrees())
                    .child(Node::to_world(to_world));
                if camera.aperture > 0.0 {
                    node.float("aperture_radius", 0.5 * camera.aperture).float("focus_distance", camera.focus)
                } else {
                    node
                }
            }
            Projection::Orthographic { half_height } => {
                if camera.aperture > 0.0 {
                    self.notes.dropped("", "defocus: Mitsuba's orthographic camera has no lens");
                }
                let half_width = half_height * width as f32 / height.max(1) as f32;
                let scale = Affine3A::from_scale(Vec3::new(half_width, half_width, 1.0));
                Node::plugin("sensor", "orthographic").child(Node::to_world(to_world * scale))
            }
        };
        node.float("near_clip", NEAR).float("far_clip", FAR).child(self.film(settings)).child(
            // The only one that takes any number of samples.
            Node::plugin("sampler", "independent").integer("sample_count", "$spp").integer("seed", "$seed"),
        )
    }

    fn film(&mut self, settings: &Settings) -> Node {
        let [width, height] = settings.size;
        let mut film = Node::plugin("film", "hdrfilm")
            .integer("width", width)
            .integer("height", height)
            .string("pixel_format", "rgb")
            .string("component_format", "float32");
        if settings.crop.is_some() {
            let [x, y, w, h] = settings.window();
            film = film
                .integer("crop_offset_x", x)
                .integer("crop_offset_y", y)
                .integer("crop_width", w)
                .integer("crop_height", h);
        }
        let filter = settings.filter;
        film.child(match filter.kind {
            FilterKind::Box if filter.width == 1.0 => Node::plugin("rfilter", "box"),
            kind => {
                let (deviation, was) = match kind {
                    FilterKind::Gaussian => (filter.width / 6.0, "a gaussian cut at 3σ"),
                    FilterKind::Box => (filter.width / 12f32.sqrt(), "a box"),
                    FilterKind::BlackmanHarris => (BLACKMAN_HARRIS * filter.width, "Blackman–Harris"),
                };
                self.notes.approximated(
                    "",
                    format!(
                        "the filter is a gaussian cut at 4σ with σ = {deviation:.3} pixels, of the same variance; here it is \
                         {was} {} pixels wide",
                        filter.width
                    ),
                );
                Node::plugin("rfilter", "gaussian").float("stddev", deviation)
            }
        })
    }
}

/// Standard deviation over width: √((a₀/12 − (a₁ − a₂/4 + a₃/9) / 2π²) / a₀), by ∫ x² cos 2πk(x + ½) dx = 1 / 2π²k².
const BLACKMAN_HARRIS: f32 = 0.138_5;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_deviation_of_blackman_harris() {
        let pi2 = std::f64::consts::PI.powi(2);
        let second = 0.35875 / 12.0 - 0.48829 / (2.0 * pi2) + 0.14128 / (8.0 * pi2) - 0.01168 / (18.0 * pi2);
        assert!(
            ((second / 0.35875).sqrt() - BLACKMAN_HARRIS as f64).abs() < 1e-4,
            "{}",
            (second / 0.35875).sqrt()
        );
    }
}
