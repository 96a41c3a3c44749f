//! The camera, and the settings of the picture.

use glam::Vec3;

use super::{
    axes,
    document::{self, Filter},
};
use crate::{
    export::note::Notes,
    render::{self, FilterKind},
    world,
};

/// Millimetres.
const SENSOR: f32 = 24.0;
const SHORTEST_LENS: f32 = 1.0;
/// What is nearer than this share of the farthest thing is not seen.
const NEAR: f32 = 1e-7;
const NEAREST: f32 = 1e-6;

/// `reach` is the distance of the farthest thing.
pub fn camera(camera: &world::Camera, reach: f32) -> document::Camera {
    let (projection, focal_length) = match camera.projection {
        world::Projection::Perspective { vfov } => {
            let half = (0.5 * vfov).tan();
            let lens = (0.5 * SENSOR / half).max(SHORTEST_LENS);
            let projection = document::Projection::Perspective { lens, sensor_height: 2.0 * lens * half };
            (projection, 1e-3 * lens)
        }
        // Cycles takes the focal length of an orthographic camera to be 1 m.
        world::Projection::Orthographic { half_height } => {
            (document::Projection::Orthographic { height: 2.0 * half_height }, 1.0)
        }
    };
    document::Camera {
        matrix: axes::camera(&camera.to_world),
        projection,
        fstop: if camera.aperture > 0.0 { focal_length / camera.aperture } else { 0.0 },
        focus: camera.focus,
        clip: [(NEAR * reach).max(NEAREST), (2.0 * reach).max(1.0)],
    }
}

/// Distance from the camera's position within which its rays begin.
pub fn extent(camera: &world::Camera, size: [u32; 2]) -> f32 {
    let [width, height] = size.map(|n| n.max(1) as f32);
    let picture = match camera.projection {
        world::Projection::Perspective { .. } => 0.0,
        world::Projection::Orthographic { half_height } => half_height * (width / height).hypot(1.0),
    };
    picture + 0.5 * camera.aperture
}

pub fn position(camera: &world::Camera) -> Vec3 {
    camera.to_world.translation.into()
}

pub fn settings(settings: &render::Settings, notes: &mut Notes) -> document::Settings {
    if settings.noise > 0.0 || settings.time.is_some() {
        notes.dropped("", "stopping by noise or time: every pixel gets all samples, without end in time");
    }
    document::Settings {
        size: settings.size,
        crop: settings.crop.is_some().then(|| border(settings)),
        samples: settings.samples,
        seed: (settings.seed % (1 << 31)) as u32,
        bounces: settings.bounces,
        filter: filter(settings.filter, notes),
    }
}

/// Blender cuts the fractions of pixels off, so that whole ones must not fall short.
fn border(settings: &render::Settings) -> [f64; 4] {
    let [width, height] = settings.size.map(f64::from);
    let [x, y, w, h] = settings.window().map(f64::from);
    [x / width, (x + w) / width, (height - y - h) / height, (height - y) / height]
}

/// Cycles' width w is not that of the support: its gaussian is exp(−8 x² / w²) over 3 w, its Blackman–Harris filter spans
/// 2 w.
fn filter(filter: render::PixelFilter, notes: &mut Notes) -> Filter {
    let render::PixelFilter { kind, width } = filter;
    match kind {
        FilterKind::Box => {
            if width != 1.0 {
                notes.approximated("", "the box filter is always one pixel wide in Cycles");
            }
            Filter { r#type: "BOX", width: 1.0 }
        }
        FilterKind::Gaussian => {
            notes.approximated(
                "",
                "the gaussian filter of width w has the same σ = w/6, but is cut off at 6 σ instead of falling to 0 at 3 σ",
            );
            Filter { r#type: "GAUSSIAN", width: width / 1.5 }
        }
        FilterKind::BlackmanHarris => Filter { r#type: "BLACKMAN_HARRIS", width: 0.5 * width },
    }
}

#[cfg(test)]
mod tests {
    use glam::Affine3A;

    use super::*;
    use crate::world::{Camera, Projection};

    #[test]
    fn filters_are_as_wide_as_here() {
        let of = |kind, width| filter(render::PixelFilter { kind, width }, &mut Notes::default()).width;
        assert_eq!(of(FilterKind::BlackmanHarris, 3.3), 1.65);
        // σ = 3 / 6 here; exp(−x² / 2σ²) = exp(−8 x² / w²) gives w = 4 σ
        assert_eq!(of(FilterKind::Gaussian, 3.0), 2.0);
        assert_eq!(of(FilterKind::Box, 1.0), 1.0);
    }

    fn lens_of(projection: Projection, aperture: f32) -> document::Camera {
        let to_world = Affine3A::IDENTITY;
        camera(
            &Camera { name: String::new(), node: String::new(), to_world, projection, aperture, focus: 2.0 },
            100.0,
        )
    }

    #[test]
    fn any_field_of_view_has_a_lens() {
        for degrees in [0.01f32, 40.0, 90.0, 179.0] {
            let seen = lens_of(Projection::Perspective { vfov: degrees.to_radians() }, 0.05);
            let document::Projection::Perspective { lens, sensor_height } = seen.projection else {
                panic!("a perspective")
            };
            let back = 2.0 * (0.5 * sensor_height / lens).atan();
            assert!((back.to_degrees() / degrees - 1.0).abs() < 1e-5);
            assert!(lens >= SHORTEST_LENS);
            assert!((1e-3 * lens / seen.fstop - 0.05).abs() < 1e-6, "the aperture comes back");
        }
        let flat = lens_of(Projection::Orthographic { half_height: 1.5 }, 0.25);
        assert_eq!(flat.projection, document::Projection::Orthographic { height: 3.0 });
        assert_eq!(flat.fstop, 4.0);
        assert_eq!(lens_of(Projection::Orthographic { half_height: 1.0 }, 0.0).fstop, 0.0);
    }

    #[test]
    fn crops_count_from_the_bottom() {
        let cropped = render::Settings { size: [100, 50], crop: Some([10, 5, 20, 15]), ..Default::default() };
        assert_eq!(settings(&cropped, &mut Notes::default()).crop, Some([0.1, 0.3, 0.6, 0.9]));
    }
}
