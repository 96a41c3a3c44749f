//! A material at a point of a surface: textures looked up, roughness turned into alpha, the shading frame bent by the
//! normal map; out come a BSDF in that frame, emission and coverage.

mod frame;
mod layered;

use glam::{Vec2, Vec3, Vec4};

pub use frame::{Side, shading_frame};

use crate::{
    bsdf::{
        Bsdf, Conductor, Dielectric, Diffuse, FuzzyMirror, Pbr, RoughDielectric,
        fresnel::{DielectricFresnel, LayerCurve, SchlickCurve},
    },
    geometry::Frame,
    texture::Textures,
    world::{
        Alpha, ColorInput, Emission, Fresnel, Material, MetalFinish, NormalMap, ScalarInput, Surface, Volume,
    },
};

/// What a material needs to know of the point it is looked up at.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint {
    pub position: Vec3,
    /// Bound on the rounding error of `position`, per axis.
    pub error: Vec3,
    /// Geometric normal: unit, outward (the side from which triangles run counter-clockwise).
    pub ng: Vec3,
    /// Interpolated normal: unit, on the side of `ng`.
    pub ns: Vec3,
    /// World tangent and the sign of the bitangent; zero where there is none.
    pub tangent: Vec4,
    pub uvs: [Vec2; 2],
    /// Vertex colour, linear RGBA; one where there is none.
    pub color: Vec4,
}

/// What of a [`SurfacePoint`] a material makes use of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Needs {
    pub uvs: bool,
    pub tangent: bool,
    pub color: bool,
}

impl std::ops::BitOrAssign for Needs {
    fn bitor_assign(&mut self, other: Self) {
        self.uvs |= other.uvs;
        self.tangent |= other.tangent;
        self.color |= other.color;
    }
}

/// What a material, its coverage and its emission make use of.
pub fn needs(material: &Material) -> Needs {
    let mut uvs = false;
    material.clone().for_each_texture(&mut |_| uvs = true);
    let tangent = match &material.surface {
        Surface::Layered(layered) => {
            let coat = layered.clearcoat.as_ref();
            layered.anisotropy.is_some() || coat.is_some_and(|coat| coat.normal.is_some())
        }
        _ => false,
    };
    Needs { uvs, tangent: tangent || material.normal.is_some(), color: material.vertex_colors }
}

impl ColorInput {
    #[inline]
    fn at(&self, textures: &Textures, uvs: &[Vec2; 2]) -> Vec3 {
        match &self.texture {
            Some(t) => self.factor * textures.lookup(t, uvs).truncate(),
            None => self.factor,
        }
    }
}

impl ScalarInput {
    #[inline]
    fn at(&self, textures: &Textures, uvs: &[Vec2; 2]) -> f32 {
        match &self.texture {
            Some((t, 3)) => self.factor * textures.alpha(t, uvs),
            Some((t, channel)) => self.factor * textures.lookup(t, uvs)[usize::from(channel & 3)],
            None => self.factor,
        }
    }
}

/// Two shares, clamped: often two channels of one texture, which is then looked up once.
fn pair([a, b]: [&ScalarInput; 2], textures: &Textures, uvs: &[Vec2; 2]) -> [f32; 2] {
    let [x, y] = match (&a.texture, &b.texture) {
        (Some((texture, i)), Some((same, j))) if texture == same => {
            let texel = textures.lookup(texture, uvs);
            [a.factor * texel[usize::from(i & 3)], b.factor * texel[usize::from(j & 3)]]
        }
        _ => [a.at(textures, uvs), b.at(textures, uvs)],
    };
    [x.clamp(0.0, 1.0), y.clamp(0.0, 1.0)]
}

/// The share of what is behind that the surface hides: 1 for opaque materials, 0 or 1 for masked ones.
pub fn coverage(material: &Material, textures: &Textures, uvs: &[Vec2; 2], color: Vec4) -> f32 {
    let alpha = || {
        let vertex = if material.vertex_colors { color.w } else { 1.0 };
        material.coverage.at(textures, uvs) * vertex
    };
    match material.alpha {
        Alpha::Opaque => 1.0,
        Alpha::Mask { cutoff } => (alpha() >= cutoff) as u8 as f32,
        Alpha::Blend => alpha().clamp(0.0, 1.0),
    }
}

/// Radiance that leaves the front or, where the emission is two-sided, either side; before any layers above.
pub fn emission(emission: &Emission, textures: &Textures, uvs: &[Vec2; 2], front: bool) -> Vec3 {
    if front || emission.two_sided {
        emission.strength * emission.color.at(textures, uvs)
    } else {
        Vec3::ZERO
    }
}

/// The share of its own emission that a surface lets out in a direction of this cosine: sheen and clearcoat lie above it.
pub fn emission_passed(material: &Material, textures: &Textures, uvs: &[Vec2; 2], cos: f32) -> f32 {
    match &material.surface {
        Surface::Layered(layered) => layered::emission_passed(layered, textures, uvs, cos),
        _ => 1.0,
    }
}

/// The medium that lies behind a surface, on the side that its front does not face: absorption per metre.
pub fn medium(material: &Material) -> Option<Vec3> {
    match &material.surface {
        Surface::Layered(layered) => layered.medium().map(Volume::absorption),
        _ => None,
    }
}

/// Whether what the surface does depends on the wavelength, not on the three channels alone.
pub fn disperses(material: &Material) -> bool {
    matches!(&material.surface, Surface::Layered(l) if l.dispersion > 0.0 && l.volume.is_some() && l.transmission.is_some())
}

/// How a surface gathers light in one place.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Focus {
    None,
    /// Rough metal.
    Glossy,
    /// Mirrors and smooth glass.
    Sharp,
}

/// How it focuses light, the same everywhere.
pub fn focus(material: &Material, textures: &Textures) -> Focus {
    let textured = match &material.surface {
        Surface::Metal { finish: MetalFinish::Roughness { roughness, .. }, .. } => {
            roughness.texture.is_some()
        }
        Surface::Metal { finish: MetalFinish::Fuzz(_), .. } => false,
        Surface::Dielectric { roughness, .. } => roughness.texture.is_some(),
        Surface::Pbr(pbr) => pbr.roughness.texture.is_some() || pbr.metallic.texture.is_some(),
        _ => true,
    };
    if textured {
        return Focus::None;
    }
    let anywhere = SurfacePoint {
        position: Vec3::ZERO,
        error: Vec3::ZERO,
        ng: Vec3::Z,
        ns: Vec3::Z,
        tangent: Vec4::ZERO,
        uvs: [Vec2::ZERO; 2],
        color: Vec4::ONE,
    };
    match scattering(material, textures, &anywhere, Vec3::Z, None).0 {
        bsdf if bsdf.is_delta() => Focus::Sharp,
        bsdf if bsdf.is_glossy() => Focus::Glossy,
        _ => Focus::None,
    }
}

/// Whether a glossy surface has the same frame seen from either direction, so that what scatters light from one to the
/// other scatters it back.
pub fn scatters_both_ways(
    material: &Material,
    textures: &Textures,
    point: &SurfacePoint,
    [a, b]: [Vec3; 2],
) -> bool {
    let map = material.normal.as_ref().map(|map| mapped_normal(map, textures, point));
    let normal = |w| shading_frame(point, map, w, Side::Glossy).0.z;
    normal(a) == normal(b)
}

/// Whether a path from a lamp may go on from it: mirrors, metal and glass that focus, and matte surfaces.
pub fn may_carry_caustics(material: &Material) -> bool {
    match &material.surface {
        Surface::Diffuse { .. }
        | Surface::Metal { .. }
        | Surface::Dielectric { .. }
        | Surface::Pbr(_)
        | Surface::SpecularGlossiness(_) => true,
        Surface::Layered(_) | Surface::Unlit { .. } | Surface::Black => false,
    }
}

/// Whether it may be a thin wall that light crosses without being scattered.
pub fn is_wall(material: &Material) -> bool {
    matches!(&material.surface, Surface::Layered(l) if l.transmission.is_some() && l.volume.is_none())
}

/// The share of light arriving against `wo` that a smooth thin wall lets through as it came; else zero.
pub fn passed_straight(material: &Material, textures: &Textures, point: &SurfacePoint, wo: Vec3) -> Vec3 {
    if !is_wall(material) {
        return Vec3::ZERO;
    }
    match scattering(material, textures, point, wo, None) {
        (Bsdf::Layered(layered), frame) => layered.straight(frame.to_local(wo)),
        _ => Vec3::ZERO,
    }
}

/// The radiance an unlit material shows, if it is one.
pub fn unlit(material: &Material, textures: &Textures, point: &SurfacePoint) -> Option<Vec3> {
    match &material.surface {
        Surface::Unlit { color } => Some(color.at(textures, &point.uvs) * tint(material, point)),
        _ => None,
    }
}

fn tint(material: &Material, point: &SurfacePoint) -> Vec3 {
    if material.vertex_colors { point.color.truncate() } else { Vec3::ONE }
}

/// The BSDF at a point seen from the unit direction `wo`, and the frame it is in. Opaque and layered surfaces have
/// their frame turned to the side of `wo`. A dielectric's frame keeps to the outside. `wavelength`, in nm, counts where a
/// surface [`disperses`]; without it all colours refract alike.
pub fn scattering(
    material: &Material,
    textures: &Textures,
    point: &SurfacePoint,
    wo: Vec3,
    wavelength: Option<f32>,
) -> (Bsdf, Frame) {
    let color =
        |c: &ColorInput| (c.at(textures, &point.uvs) * tint(material, point)).clamp(Vec3::ZERO, Vec3::ONE);
    let unit = |s: &ScalarInput| s.at(textures, &point.uvs).clamp(0.0, 1.0);
    let framed = |side| {
        let map = material.normal.as_ref().map(|map| mapped_normal(map, textures, point));
        shading_frame(point, map, wo, side)
    };
    let prepared = |mut bsdf: Bsdf, frame: Frame| {
        bsdf.prepare(frame.to_local(wo));
        (bsdf, frame)
    };
    match &material.surface {
        Surface::Diffuse { color: c } => (Bsdf::Diffuse(Diffuse { color: color(c) }), framed(Side::Matte).0),
        Surface::Metal { color: c, finish: MetalFinish::Fuzz(fuzz) } => {
            (FuzzyMirror::bsdf(color(c), *fuzz), framed(Side::Glossy).0)
        }
        Surface::Metal { color: c, finish: MetalFinish::Roughness { roughness, fresnel, multiscatter } } => {
            let curve = match fresnel {
                Fresnel::Constant => SchlickCurve::constant(color(c)),
                Fresnel::Schlick | Fresnel::Exact => SchlickCurve::metal(color(c)),
            };
            let bsdf = Conductor::bsdf(curve, alpha(unit(roughness)), *multiscatter);
            prepared(bsdf, framed(Side::Glossy).0)
        }
        Surface::Dielectric { ior, fresnel, roughness, tint } => {
            let fresnel = match fresnel {
                Fresnel::Schlick => DielectricFresnel::Schlick,
                Fresnel::Exact | Fresnel::Constant => DielectricFresnel::Exact,
            };
            let boundary = Dielectric { ior: *ior, fresnel, tint: color(tint) };
            let bsdf = RoughDielectric::bsdf(boundary, alpha(unit(roughness)), true);
            prepared(bsdf, framed(Side::Boundary).0)
        }
        Surface::Pbr(pbr) => {
            let [metallic, roughness] = pair([&pbr.metallic, &pbr.roughness], textures, &point.uvs);
            let (base, layer) = (color(&pbr.base_color), LayerCurve::dielectric(pbr.ior));
            let (frame, matte) = framed(Side::Glossy);
            let bsdf = Pbr::bsdf(base, metallic, alpha(roughness), layer, pbr.multiscatter, matte);
            prepared(bsdf, frame)
        }
        Surface::SpecularGlossiness(surface) => {
            let specular = color(&surface.specular);
            // archived extension, "Specular - Glossiness": c_diff = diffuse (1 − max(specular))
            let diffuse = color(&surface.diffuse) * (1.0 - specular.max_element());
            let curve = LayerCurve { f0: specular, ..LayerCurve::dielectric(1.5) };
            let (frame, matte) = framed(Side::Glossy);
            let alpha = alpha(1.0 - unit(&surface.glossiness));
            prepared(Pbr::bsdf(diffuse, 0.0, alpha, curve, true, matte), frame)
        }
        Surface::Layered(layered) => {
            let tint = tint(material, point);
            let place = layered::Place { textures, point, tint, wo, wavelength };
            let (bsdf, frame) = layered::scattering(layered, material.normal.as_ref(), &place);
            prepared(bsdf, frame)
        }
        Surface::Unlit { .. } | Surface::Black => (Bsdf::Black, framed(Side::Matte).0),
    }
}

/// The normal in tangent space that a map gives, not of unit length.
fn mapped_normal(map: &NormalMap, textures: &Textures, point: &SurfacePoint) -> Vec3 {
    let n = 2.0 * textures.lookup(&map.texture, &point.uvs).truncate() - 1.0;
    Vec3::new(n.x * map.scale, n.y * map.scale, n.z)
}

/// Perceptual roughness to the width of the microfacet distribution (glTF 2.0, B.3.1).
fn alpha(roughness: f32) -> f32 {
    roughness * roughness
}
