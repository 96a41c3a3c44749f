//! The camera and `scene.ini`.
//!
//! POV-Ray sends the ray through (x, y) in [−½, ½]² along `direction` + x·`right` + y·`up`, whatever those three are.
//! Written out, they give the exact field of view at any angle and a crop, and as they are a right-handed frame here,
//! nothing in the scene is mirrored: "left-handed" is only what POV-Ray's own defaults for them are.
//!
//! Thin lens: measured, the rays start from a disk whose diameter is half of `aperture`.

use std::fmt::Write;

use glam::{DVec3, Vec3};

use super::sdl::{dvec3, num64};
use crate::{
    export::note::Notes,
    render::{FilterKind, Settings},
    world::{Camera, Projection},
};

/// Samples along a side of a pixel that POV-Ray takes at most.
const MOST_PER_SIDE: u32 = 9;
/// Lens samples of a pixel, at least and at most.
const LENS_SAMPLES: [u32; 2] = [37, 1024];

/// Samples along a side of a pixel; 1 is no antialiasing.
fn per_side(samples: u32) -> u32 {
    ((samples as f32).sqrt().round() as u32).clamp(1, MOST_PER_SIDE)
}

/// Samples of a pixel: the square and one in its middle, or those of the lens.
pub fn samples(camera: &Camera, settings: &Settings) -> u32 {
    let [least, most] = LENS_SAMPLES;
    match per_side(settings.samples) {
        _ if camera.aperture > 0.0 => settings.samples.clamp(least, most),
        1 => 1,
        side => side * side + 1,
    }
}

/// `unit` is POV-Ray units per metre.
pub fn camera(camera: &Camera, settings: &Settings, unit: f32, notes: &mut Notes) -> String {
    let [width, height] = settings.size.map(|n| f64::from(n.max(1)));
    let [x, y, w, h] = settings.window().map(f64::from);
    let [right, up, back] = frame(camera);
    let (half_height, orthographic) = match camera.projection {
        Projection::Perspective { vfov } => ((0.5 * f64::from(vfov)).tan(), false),
        Projection::Orthographic { half_height } => (f64::from(half_height), true),
    };
    let pixel = 2.0 * half_height / height;
    // To the middle of the crop, on the plane at distance 1.
    let aside = right * (x + 0.5 * (w - width)) * pixel - up * (y + 0.5 * (h - height)) * pixel;
    let position = Vec3::from(camera.to_world.translation).as_dvec3();
    let unit = f64::from(unit);
    let mut out = String::from("camera {\n");
    let (location, forward, length) = if orthographic {
        out.push_str("  orthographic\n");
        (position + aside, -back, unit)
    } else {
        (position, aside - back, 1.0)
    };
    let (right, up) = (right * (w * pixel * length), up * (h * pixel * length));
    let _ = writeln!(out, "  location {}\n  direction {}", dvec3(location * unit), dvec3(forward));
    let _ = writeln!(out, "  right {}\n  up {}", dvec3(right), dvec3(up));
    if camera.aperture > 0.0 {
        let samples = samples(camera, settings);
        let focal = location + forward * f64::from(camera.focus);
        let _ = writeln!(
            out,
            "  aperture {} focal_point {}\n  blur_samples {samples} variance 0 confidence 0.999",
            num64(2.0 * f64::from(camera.aperture) * unit),
            dvec3(focal * unit)
        );
        if aside != DVec3::ZERO {
            notes.approximated("the crop", "with a lens: the lens is turned to face the middle of the crop");
        }
    }
    out.push_str("}\n");
    out
}

/// Right, up and back, as square to each other as doubles can be: POV-Ray warns of less.
fn frame(camera: &Camera) -> [DVec3; 3] {
    let m = camera.to_world.matrix3.as_dmat3();
    let back = m.z_axis.normalize_or(DVec3::Z);
    let right = m.y_axis.cross(back).normalize_or(back.any_orthonormal_vector());
    [right, back.cross(right), back]
}

/// What decides the picture besides the scene.
pub fn ini(camera: &Camera, settings: &Settings, notes: &mut Notes) -> String {
    if settings.filter.kind != FilterKind::Box || settings.filter.width != 1.0 {
        notes.approximated(
            "",
            "the pixel filter: POV-Ray averages over the pixel; compare with filter = { type = \"box\", width = 1 }",
        );
    }
    let [_, _, width, height] = settings.window();
    let side = per_side(settings.samples);
    let lens = camera.aperture > 0.0;
    let mut out = String::from(
        "Input_File_Name=scene.pov\nOutput_File_Name=scene.exr\nOutput_to_File=on\n\
         ; scene-linear OpenEXR\nOutput_File_Type=E\nFile_Gamma=1.0\nOutput_Alpha=off\n\
         Display=off\nVerbose=off\nPause_when_Done=off\nQuality=9\n",
    );
    let _ = write!(out, "Width={width}\nHeight={height}\n");
    if [width, height] != settings.size {
        out.push_str("; a crop looks aside, \"camera vectors are not perpendicular\": so they are to be\nWarning_Level=0\n");
    }
    if lens {
        out.push_str("; the samples of the lens are those of the pixel\nAntialias=off\n");
    } else if side < 2 {
        out.push_str("Antialias=off\n");
    } else {
        let _ = write!(
            out,
            "; every pixel is the linear mean of side × side jittered samples, and the one at its centre\n\
             Antialias=on\nSampling_Method=1\nAntialias_Threshold=0.0\nAntialias_Gamma=1.0\n\
             Antialias_Depth={side}\nJitter=on\nJitter_Amount=1.0\n",
        );
    }
    out
}

#[cfg(test)]
mod tests {
    use glam::Affine3A;

    use super::*;

    fn perspective() -> Camera {
        Camera {
            name: String::new(),
            node: String::new(),
            to_world: Affine3A::from_translation(Vec3::new(0.0, 1.0, 5.0)),
            projection: Projection::Perspective { vfov: std::f32::consts::FRAC_PI_2 },
            aperture: 0.0,
            focus: 4.0,
        }
    }

    fn settings() -> Settings {
        Settings { size: [200, 100], ..Settings::default() }
    }

    fn numbers(sdl: &str, key: &str) -> DVec3 {
        let list = sdl.split(key).nth(1).and_then(|rest| rest.split('>').next()).expect("the key");
        let numbers: Vec<f64> = list.split(',').map(|x| x.parse().expect("a number")).collect();
        DVec3::from_slice(&numbers)
    }

    #[test]
    fn the_frame_is_right_handed_and_exact() {
        let sdl = camera(&perspective(), &settings(), 2.0, &mut Notes::default());
        assert!(sdl.contains("location <0.0,2.0,10.0>"), "{sdl}");
        assert!(sdl.contains("direction <0.0,0.0,-1.0>"), "{sdl}");
        let [right, up] = ["right <", "up <"].map(|key| numbers(&sdl, key));
        assert!(right.abs_diff_eq(DVec3::X * 4.0, 1e-6) && up.abs_diff_eq(DVec3::Y * 2.0, 1e-6), "{sdl}");
    }

    #[test]
    fn a_crop_looks_to_its_own_middle() {
        let crop = Settings { crop: Some([100, 0, 100, 50]), ..settings() };
        let mut notes = Notes::default();
        let sdl = camera(&perspective(), &crop, 1.0, &mut notes);
        assert!(numbers(&sdl, "direction <").abs_diff_eq(DVec3::new(1.0, 0.5, -1.0), 1e-6), "{sdl}");
        let [right, up] = ["right <", "up <"].map(|key| numbers(&sdl, key));
        assert!(right.abs_diff_eq(DVec3::X * 2.0, 1e-6) && up.abs_diff_eq(DVec3::Y, 1e-6), "{sdl}");
        assert!(ini(&perspective(), &crop, &mut notes).contains("Width=100\nHeight=50\n"));
    }

    #[test]
    fn the_lens_is_half_the_aperture() {
        let lens = Camera { aperture: 0.25, ..perspective() };
        let sdl = camera(&lens, &settings(), 2.0, &mut Notes::default());
        assert!(sdl.contains("aperture 1.0 focal_point <0.0,2.0,2.0>"), "{sdl}");
        assert!(ini(&lens, &settings(), &mut Notes::default()).contains("Antialias=off"));
    }

    #[test]
    fn samples_fill_a_square() {
        assert_eq!([1, 2, 16, 64, 100, 1 << 24].map(per_side), [1, 1, 4, 8, 9, 9]);
    }
}
