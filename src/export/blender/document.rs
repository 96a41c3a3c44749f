//! `scene.json`, as `scene.py` reads it: Blender's axes and units.

use serde::Serialize;

use super::{arrays::Span, layered::Curve};

/// Rows of a matrix from object to world.
pub type Matrix = [[f32; 4]; 4];

#[derive(Debug, Serialize)]
pub struct Document {
    pub rayo: &'static str,
    /// The script saves `scene.blend`, too.
    pub save_blend: bool,
    pub settings: Settings,
    pub camera: Camera,
    pub world: World,
    pub lights: Vec<Light>,
    pub images: Vec<Image>,
    pub materials: Vec<Material>,
    pub meshes: Vec<Mesh>,
    pub instances: Vec<Instance>,
    pub points: Vec<Points>,
}

#[derive(Debug, Serialize)]
pub struct Settings {
    pub size: [u32; 2],
    /// Left, right, bottom, top, as shares of the picture.
    pub crop: Option<[f64; 4]>,
    pub samples: u32,
    pub seed: u32,
    pub bounces: crate::render::Bounces,
    pub filter: Filter,
}

#[derive(Debug, Serialize)]
pub struct Filter {
    pub r#type: &'static str,
    pub width: f32,
}

#[derive(Debug, Serialize)]
pub struct Camera {
    pub matrix: Matrix,
    #[serde(flatten)]
    pub projection: Projection,
    /// 0: a pinhole.
    pub fstop: f32,
    pub focus: f32,
    /// Distances of the first and the last thing that is seen.
    pub clip: [f32; 2],
}

#[derive(Debug, PartialEq, Serialize)]
#[serde(tag = "type")]
pub enum Projection {
    /// Millimetres.
    #[serde(rename = "PERSP")]
    Perspective { lens: f32, sensor_height: f32 },
    #[serde(rename = "ORTHO")]
    Orthographic { height: f32 },
}

#[derive(Debug, Serialize)]
pub struct World {
    #[serde(flatten)]
    pub kind: WorldKind,
    pub strength: f32,
    pub visible: bool,
}

#[derive(Debug, Serialize)]
#[serde(tag = "type", rename_all = "lowercase")]
pub enum WorldKind {
    Color {
        color: [f32; 3],
    },
    Gradient {
        bottom: [f32; 3],
        top: [f32; 3],
    },
    Image {
        image: usize,
        rotation: f32,
        /// z of the middle of the first row of texels.
        highest: f32,
        map_resolution: u32,
    },
}

#[derive(Debug, Serialize)]
pub struct Light {
    pub name: String,
    pub r#type: &'static str,
    /// W; of a sun, W/m².
    pub strength: [f32; 3],
    pub position: [f32; 3],
    /// Where the light goes.
    pub direction: Option<[f32; 3]>,
    pub radius: f32,
    /// Angular diameter of a sun.
    pub angle: f32,
    /// Whole angle of a spot's cone.
    pub spot_size: f32,
    /// cos outer, and 1 / (cos inner − cos outer).
    pub cone: Option<[f32; 2]>,
}

#[derive(Debug, PartialEq, Eq, Hash, Clone, Serialize)]
pub struct Image {
    pub file: String,
    pub color_space: &'static str,
}

#[derive(Debug, Serialize)]
pub struct Mesh {
    pub name: String,
    pub positions: Span,
    pub triangles: Span,
    /// By vertex.
    pub normals: Option<Span>,
    pub uvs: [Option<Span>; 2],
    pub colors: Option<Span>,
    pub tangents: Option<Span>,
    pub tangent_signs: Option<Span>,
    /// Else by vertex.
    pub tangents_by_corner: bool,
    /// By triangle.
    pub slots: Option<Span>,
    pub slot_count: usize,
}

#[derive(Debug, Serialize)]
pub struct Instance {
    pub name: String,
    pub mesh: usize,
    /// None: the mesh is where it belongs.
    pub matrix: Option<Matrix>,
    pub materials: Vec<usize>,
}

/// Spheres of one material.
#[derive(Debug, Serialize)]
pub struct Points {
    pub name: String,
    pub material: usize,
    pub centers: Span,
    pub radii: Span,
}

#[derive(Debug, Serialize)]
pub struct Material {
    pub name: String,
    /// Texture coordinates and tangents are those of a sphere, by its normal.
    pub sphere: bool,
    pub surface: Surface,
    pub absorption: Option<Absorption>,
    pub emission: Option<Emission>,
    pub emission_sampling: &'static str,
    pub alpha: Option<Alpha>,
    pub normal: Option<NormalMap>,
    /// Whether Cycles bends mapped normals until they mirror outwards, and dims light that grazes the surface.
    pub bump_correction: bool,
    /// Camera rays pass the backs.
    pub cull_backs: bool,
}

#[derive(Debug, PartialEq, Serialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum Surface {
    Diffuse { color: Color },
    Glossy { color: Color, roughness: Value, distribution: &'static str },
    Glass { color: Color, roughness: Value, ior: f32 },
    SchlickGlass { color: Color, ior: f32 },
    Principled { color: Color, metallic: Value, roughness: Value, ior: f32, distribution: &'static str },
    Layered(Box<Layered>),
    SpecularGlossiness { diffuse: Color, specular: Color, glossiness: Value },
    Unlit { color: Color },
    Black,
}

/// As `principled`, with layers.
#[derive(Debug, PartialEq, Serialize)]
pub struct Layered {
    pub color: Color,
    pub metallic: Value,
    pub roughness: Value,
    pub ior: f32,
    pub distribution: &'static str,
    pub specular: Option<Specular>,
    pub coat: Option<Coat>,
    pub sheen: Option<Sheen>,
    pub film: Option<Film>,
    pub anisotropy: Option<Anisotropy>,
    pub transmission: Option<Value>,
    /// The surface refracts, and layers lie on its outside; else it is a wall without thickness.
    pub solid: bool,
    pub diffuse_transmission: Option<DiffuseTransmission>,
    /// The share of light that layers leave to the wall and to diffuse transmission.
    pub passed: Option<Curve>,
}

#[derive(Debug, PartialEq, Serialize)]
pub struct Specular {
    pub factor: Value,
    pub tint: Color,
    /// What the tint is clamped to.
    pub most: f32,
}

#[derive(Debug, PartialEq, Serialize)]
pub struct Coat {
    pub weight: Value,
    pub roughness: Value,
    /// None: that of the mesh.
    pub normal: Option<NormalMap>,
}

#[derive(Debug, PartialEq, Serialize)]
pub struct Sheen {
    pub color: Color,
    pub roughness: Value,
}

#[derive(Debug, PartialEq, Serialize)]
pub struct Film {
    pub weight: Value,
    pub ior: f32,
    /// Nanometres where the texture is 0 and where it is 1; the latter without a texture.
    pub thickness: [f32; 2],
    pub thickness_texture: Option<Value>,
}

#[derive(Debug, PartialEq, Serialize)]
pub struct Anisotropy {
    pub strength: f32,
    pub rotation: f32,
    pub texture: Option<Lookup>,
}

#[derive(Debug, PartialEq, Serialize)]
pub struct DiffuseTransmission {
    pub factor: Value,
    pub color: Color,
}

/// What is inside absorbs density (1 − color) per metre.
#[derive(Debug, PartialEq, Serialize)]
pub struct Absorption {
    pub color: [f32; 3],
    pub density: f32,
}

#[derive(Debug, Serialize)]
pub struct Emission {
    pub color: Color,
    pub strength: f32,
    pub two_sided: bool,
    /// A lamp of the same shape gives the light.
    pub camera_only: bool,
    /// The share that layers above let out.
    pub passed: Option<Curve>,
}

#[derive(Debug, Serialize)]
pub struct Alpha {
    pub coverage: Value,
    /// Vertex colours multiply the coverage.
    pub vertex: bool,
    /// None: blended.
    pub cutoff: Option<f32>,
}

#[derive(Debug, PartialEq, Serialize)]
pub struct NormalMap {
    pub texture: Lookup,
    pub scale: f32,
}

#[derive(Debug, PartialEq, Serialize)]
pub struct Color {
    pub factor: [f32; 3],
    pub texture: Option<Lookup>,
    /// Vertex colours multiply it.
    pub vertex: bool,
    /// To 0 … 1.
    pub clamp: bool,
}

#[derive(Debug, PartialEq, Serialize)]
pub struct Value {
    pub factor: f32,
    pub texture: Option<Lookup>,
    /// 0 = R … 3 = A.
    pub channel: u8,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Lookup {
    pub image: usize,
    pub interpolation: &'static str,
    pub extension: &'static str,
    pub uv_set: u8,
    /// Rows of the matrix from UV to image coordinates, v upwards; none where they are the same.
    pub transform: Option<[[f32; 3]; 2]>,
    pub fold_u: Option<Fold>,
    pub fold_v: Option<Fold>,
}

/// What is done to a coordinate before the image node wraps it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Fold {
    pub mirror: bool,
    /// It stays this far from 0 and 1.
    pub half_texel: f32,
}
