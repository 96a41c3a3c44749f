//! `[environment]`: light from infinitely far away.

use super::{
    EnvironmentSource, EnvironmentSourceKind,
    color::Color,
    context::Context,
    path::ImageFile,
    range::from,
    table::{table, tagged},
};

tagged! {
    /// Light from infinitely far away, by direction. Without this table there is none.
    enum Environment { Uniform, Gradient, Image }
    later "sky"
}

table! {
    /// The same radiance from everywhere.
    struct Uniform as "color" {
        /// Radiance, W/m²/sr.
        color: Color = Color::WHITE,
        /// Factor on the radiance.
        strength: f32 = 1.0; from(0.0),
        /// Whether camera rays see it. It lights the scene either way.
        visible: bool = true,
    }
}

table! {
    /// From one colour straight below to another straight above: a linear blend in t = (y + 1) / 2.
    struct Gradient as "gradient" {
        /// Radiance from straight below, W/m²/sr.
        bottom: Color = Color::WHITE,
        /// Radiance from straight above, W/m²/sr.
        top: Color = Color([0.5, 0.7, 1.0]),
        /// Factor on the radiance.
        strength: f32 = 1.0; from(0.0),
        /// Whether camera rays see it. It lights the scene either way.
        visible: bool = true,
    }
}

table! {
    /// A panorama: direction d meets it at u = 0.5 + atan2(d.z, d.x) / 2π, v = acos(d.y) / π, v = 0 at the top row.
    struct Image as "image" {
        /// Equirectangular picture; .hdr and .exr are scene-linear, others sRGB.
        file: ImageFile,
        /// Turns it about +Y, counter-clockwise seen from above, degrees.
        rotation: f32 = 0.0,
        /// Factor on the radiance.
        strength: f32 = 1.0; from(0.0),
        /// Whether camera rays see it. It lights the scene either way.
        visible: bool = true,
    }
}

impl Environment {
    pub fn resolve(self, cx: &Context) -> EnvironmentSource {
        let (kind, strength, rotation, visible) = match self {
            Self::Uniform(e) => (EnvironmentSourceKind::Color(e.color.vec()), e.strength, 0.0, e.visible),
            Self::Gradient(e) => {
                let kind = EnvironmentSourceKind::Gradient { bottom: e.bottom.vec(), top: e.top.vec() };
                (kind, e.strength, 0.0, e.visible)
            }
            Self::Image(e) => {
                let place = cx.place(e.keys.value("file"));
                let kind = EnvironmentSourceKind::Image { file: e.file.0, place };
                (kind, e.strength, e.rotation.to_radians(), e.visible)
            }
        };
        EnvironmentSource { kind, strength, rotation, visible }
    }
}
