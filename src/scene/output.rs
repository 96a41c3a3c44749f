//! `[output]`: where the picture goes, and how it is encoded.

use std::path::PathBuf;

use schemars::json_schema;
use toml::de::DeValue;

use super::{
    choice::choice,
    context::Context,
    path::OutputFile,
    range::from,
    read::{Read, Value, kind},
    table::{inline_schema, table},
};
use crate::output::{Depth, Settings, View};

table! {
    /// The file that is written.
    struct Output {
        /// .png, .exr or .hdr, relative to the scene file. Without it: the scene file's name with .png.
        file: Option<OutputFile>,
        /// How light becomes the numbers of a PNG: "srgb", "gamma2" (square root) or "raw" (no curve).
        view: ViewName = ViewName::Srgb,
        /// Stops, for PNG: light is multiplied by 2 to this power.
        exposure: f32 = 0.0; from(-64.0).to(64.0),
        /// 8 or 16 bits for .png, "half" or "float" for .exr. Without it: 8, half.
        depth: Option<DepthName>,
        /// Whether the file also holds the estimated variance of each pixel (.exr only).
        variance: bool = false,
    }
}

choice! {
    /// View transforms.
    enum ViewName { "srgb" => Srgb, "gamma2" => Gamma2, "raw" => Raw }
    later "agx" "pbr-neutral" "aces"
}

/// 8, 16, "half" or "float".
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum DepthName {
    Eight,
    Sixteen,
    Half,
    Float,
}

impl Output {
    pub fn resolve(self, cx: &mut Context) -> Settings {
        let file = match self.file {
            Some(file) => file.0,
            None => default_file(cx),
        };
        let extension = file.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
        let fits: &[DepthName] = match extension.as_str() {
            "png" => &[DepthName::Eight, DepthName::Sixteen],
            "exr" => &[DepthName::Half, DepthName::Float],
            _ => &[],
        };
        if let Some(depth) = self.depth
            && self.keys.sound(&["file"])
            && !fits.contains(&depth)
        {
            let help = match extension.as_str() {
                "png" => "8 or 16",
                "exr" => "\"half\" or \"float\"",
                _ => "leave it out",
            };
            cx.error(self.keys.value("depth"), format!("a .{extension} file has no such `depth`")).help(help);
        }
        if self.variance && self.keys.sound(&["file"]) && extension != "exr" {
            let message = format!("a .{extension} file cannot hold the variance");
            cx.error(self.keys.value("variance"), message).help("set `file` to a name that ends in .exr");
        }
        Settings {
            file,
            view: match self.view {
                ViewName::Srgb => View::Srgb,
                ViewName::Gamma2 => View::Gamma2,
                ViewName::Raw => View::Raw,
            },
            exposure: self.exposure,
            depth: match self.depth {
                Some(DepthName::Sixteen | DepthName::Float) => Depth::High,
                Some(DepthName::Eight | DepthName::Half) | None => Depth::Low,
            },
            variance: self.variance,
        }
    }
}

fn default_file(cx: &Context) -> PathBuf {
    cx.file().with_extension("png")
}

impl Read for DepthName {
    fn read(value: &Value, cx: &mut Context) -> Option<Self> {
        const FORMS: &str = "8, 16, \"half\" or \"float\"";
        let found = match value.get_ref() {
            DeValue::Integer(integer) if integer.as_str() == "8" => return Some(Self::Eight),
            DeValue::Integer(integer) if integer.as_str() == "16" => return Some(Self::Sixteen),
            DeValue::String(text) if text == "half" => return Some(Self::Half),
            DeValue::String(text) if text == "float" => return Some(Self::Float),
            DeValue::Integer(integer) => crate::diagnostic::quote(integer.as_str()),
            DeValue::String(text) => crate::diagnostic::quote(text),
            _ => kind(value).to_owned(),
        };
        cx.must(value.span(), FORMS, &found);
        None
    }
}

inline_schema! {
    DepthName, _generator: json_schema!({ "enum": [8, 16, "half", "float"] }),
}
