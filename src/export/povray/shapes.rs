//! Spheres, quads and meshes as objects.

use std::{
    collections::{BTreeSet, HashMap},
    fmt::Write,
};

use glam::{Affine3A, Mat3, Vec3, Vec4};

use super::{
    finish::BLACK,
    glass::{around, closed},
    material::{Interior, Look, Looks, Mapping},
    mesh::Part,
    sdl::{matrix, num, vec3},
};
use crate::{
    export::{Error, names::Names, shading},
    world::{Instance, Material, Mesh, Projection, Quad, Sphere, Surface, World},
};

/// Half the objects are at least so large, in units: POV-Ray takes surfaces for one that are within 0.001.
const EXTENT: f32 = 128.0;
/// And all are within this: POV-Ray's world ends at 10⁷.
const LARGEST: f32 = 1e6;
/// Textures in the list of a mesh with colours at its vertices; beyond, colours are rounded to 8 bits.
const MOST_COLORS: usize = 4096;

/// The objects, and the files they include.
pub struct Shapes {
    pub scene: String,
    pub files: Vec<(String, Vec<u8>)>,
}

/// A power of two, so that no digit is lost.
pub fn units_per_metre(world: &World) -> f32 {
    let mut extents: Vec<f32> = world.spheres.iter().map(|s| 2.0 * s.radius).collect();
    extents.extend(world.quads.iter().map(|q| (q.u + q.v).length()));
    let mut farthest = world.camera.to_world.translation.length();
    for sphere in &world.spheres {
        farthest = farthest.max(sphere.center.length() + sphere.radius);
    }
    for quad in &world.quads {
        farthest = farthest.max(quad.origin.length() + (quad.u + quad.v).length());
    }
    let boxes = mesh_boxes(world);
    for (low, high) in boxes.into_iter().flatten() {
        extents.push(low.distance(high));
        farthest = farthest.max(low.length().max(high.length()));
    }
    extents.retain(|e| e.is_finite() && *e > 0.0);
    extents.sort_by(f32::total_cmp);
    let middle = extents.get(extents.len() / 2).copied().unwrap_or(1.0);
    let wanted = (EXTENT / middle).log2().ceil().clamp(0.0, 40.0);
    let most = (LARGEST / farthest.max(1e-30)).log2().floor().clamp(-100.0, 100.0);
    wanted.min(most).exp2()
}

/// World bounds of each instance.
fn mesh_boxes(world: &World) -> Vec<Option<(Vec3, Vec3)>> {
    let local: Vec<Option<(Vec3, Vec3)>> = world
        .model
        .meshes
        .iter()
        .map(|mesh| mesh.positions.iter().filter(|p| p.is_finite()).map(|&p| (p, p)).reduce(union))
        .collect();
    let place = |instance: &Instance| {
        let (low, high) = local.get(instance.mesh.index()).copied().flatten()?;
        let corner = |i: u32| {
            let pick = |bit: u32, a: f32, b: f32| if i >> bit & 1 == 0 { a } else { b };
            let p = Vec3::new(pick(0, low.x, high.x), pick(1, low.y, high.y), pick(2, low.z, high.z));
            instance.to_world.transform_point3(p)
        };
        (0..8).map(|i| (corner(i), corner(i))).reduce(union)
    };
    world.model.instances.iter().map(place).collect()
}

fn union(a: (Vec3, Vec3), b: (Vec3, Vec3)) -> (Vec3, Vec3) {
    (a.0.min(b.0), a.1.max(b.1))
}

pub fn write(looks: &mut Looks, unit: f32) -> Result<Shapes, Error> {
    let world = looks.world;
    let mut out = Writer {
        looks,
        unit,
        scene: String::new(),
        files: Vec::new(),
        meshes: HashMap::new(),
        names: Names::default(),
    };
    for (i, sphere) in world.spheres.iter().enumerate() {
        out.sphere(i, sphere)?;
    }
    for quad in &world.quads {
        out.quad(quad)?;
    }
    let boxes = mesh_boxes(world);
    for (instance, bounds) in world.model.instances.iter().zip(boxes) {
        let Some(mesh) = world.model.meshes.get(instance.mesh.index()) else { continue };
        out.instance(instance, mesh, bounds)?;
    }
    Ok(Shapes { scene: out.scene, files: out.files })
}

/// What distinguishes declared meshes: mesh, slot, UV set, and the material where it is in the mesh.
type MeshKey = (u32, usize, Option<u8>, Option<u32>);

struct Writer<'a, 'b> {
    looks: &'a mut Looks<'b>,
    unit: f32,
    scene: String,
    files: Vec<(String, Vec<u8>)>,
    meshes: HashMap<MeshKey, Option<String>>,
    names: Names,
}

impl Writer<'_, '_> {
    fn sphere(&mut self, i: usize, sphere: &Sphere) -> Result<(), Error> {
        if !(sphere.center.is_finite() && sphere.radius > 0.0 && sphere.radius.is_finite()) {
            return Ok(());
        }
        let look = self.looks.look(sphere.material, Mapping::Sphere)?;
        let shape =
            format!("sphere {{ {}, {}", vec3(sphere.center * self.unit), num(sphere.radius * self.unit));
        let eye = Vec3::from(self.looks.world.camera.to_world.translation);
        let inside = eye.distance(sphere.center) < sphere.radius;
        let hidden = inside && !self.double_sided(sphere.material);
        let outside = around(self.looks.world, sphere.center, sphere.radius, Some(i));
        self.object(&shape, &look, outside, hidden, true);
        Ok(())
    }

    fn quad(&mut self, quad: &Quad) -> Result<(), Error> {
        let normal = quad.u.cross(quad.v).normalize_or_zero();
        if normal == Vec3::ZERO || !(normal.is_finite() && quad.origin.is_finite()) {
            return Ok(());
        }
        let look = self.looks.look(quad.material, Mapping::Given)?;
        let Quad { origin, u, v, .. } = *quad;
        let corners = [origin, origin + u, origin + u + v, origin + v].map(|p| vec3(p * self.unit)).join(",");
        let mut shape = format!(
            "mesh2 {{ vertex_vectors {{ 4,{corners} }} uv_vectors {{ 4,<0,1>,<1,1>,<1,0>,<0,0> }} face_indices {{ \
             2,<0,2,1>,<0,3,2> }}"
        );
        if quad.round {
            let axes = Mat3::from_cols(0.5 * u, 0.5 * v, normal * (u.length() + v.length())) * self.unit;
            let place = Affine3A::from_mat3_translation(axes, (origin + 0.5 * (u + v)) * self.unit);
            let _ = write!(shape, " clipped_by {{ cylinder {{ -z, z, 1 {} }} }}", matrix(&place));
        }
        let camera = &self.looks.world.camera;
        let ray = match camera.projection {
            Projection::Perspective { .. } => origin - Vec3::from(camera.to_world.translation),
            Projection::Orthographic { .. } => camera.to_world.transform_vector3(Vec3::NEG_Z),
        };
        let hidden = ray.dot(normal) > 0.0 && !self.double_sided(quad.material);
        if matches!(look.interior, Some(Interior::Glass(_))) {
            self.open_glass(quad.material);
        }
        self.object(&shape, &look, 1.0, hidden, true);
        Ok(())
    }

    fn instance(
        &mut self,
        instance: &Instance,
        mesh: &Mesh,
        bounds: Option<(Vec3, Vec3)>,
    ) -> Result<(), Error> {
        if !instance.to_world.is_finite() {
            return Ok(());
        }
        let scaled = Affine3A::from_scale(Vec3::splat(self.unit)) * instance.to_world;
        for (slot, &id) in instance.materials.iter().enumerate() {
            let Some(material) = self.looks.material(id) else { continue };
            let colored = material.vertex_colors && !mesh.colors.is_empty();
            let textured = has_texture(material);
            let listed = colored && !textured;
            let look = self.looks.look(id, Mapping::Given)?;
            let uv_set = look.uv.then(|| self.looks.uv_set(material));
            let key = (instance.mesh.0, slot, uv_set, listed.then_some(id.0));
            let name = match self.meshes.get(&key) {
                Some(name) => name.clone(),
                None => {
                    let name = self.declare(mesh, slot, uv_set, listed.then_some(material))?;
                    self.meshes.insert(key, name.clone());
                    name
                }
            };
            let Some(name) = name else { continue };
            if colored && textured {
                let subject = format!("material `{}`", material.name);
                self.looks.notes.dropped(subject, "the colours at the vertices, which multiply a texture");
            }
            let is_glass = matches!(look.interior, Some(Interior::Glass(_)));
            if (is_glass || !material.double_sided) && !closed(mesh) {
                if is_glass {
                    self.open_glass(id);
                } else {
                    let subject = format!("material `{}`", material.name);
                    self.looks.notes.approximated(subject, "seen from behind, too, where its mesh is open");
                }
            }
            let outside = bounds.map_or(1.0, |(low, high)| {
                around(self.looks.world, 0.5 * (low + high), 0.5 * low.distance(high), None)
            });
            let shape = format!("object {{ {name} {}", matrix(&scaled));
            self.object(&shape, &look, outside, false, !listed);
        }
        Ok(())
    }

    fn open_glass(&mut self, id: crate::world::MaterialId) {
        let name = self.looks.material(id).map_or("", |m| &m.name);
        let subject = format!("material `{name}`");
        self.looks.notes.approximated(
            subject,
            "glass whose surface is not closed: rays are inside after every other surface, whatever its side",
        );
    }

    fn double_sided(&self, id: crate::world::MaterialId) -> bool {
        self.looks.material(id).is_none_or(|m| m.double_sided)
    }

    /// `shape` is the object without its closing brace.
    fn object(&mut self, shape: &str, look: &Look, outside: f32, hidden: bool, textured: bool) {
        let mut object = shape.to_owned();
        if look.uv {
            object.push_str(" uv_mapping");
        }
        if textured {
            let _ = write!(object, " {}", look.texture);
            if let Some(back) = &look.back {
                let _ = write!(object, " interior_{back}");
            }
        }
        match look.interior {
            Some(Interior::Thin) => object.push_str(" interior { ior 1 }"),
            Some(Interior::Glass(ior)) => {
                let _ = write!(object, " interior {{ ior {} }} no_shadow", num(ior * outside));
            }
            None => {}
        }
        if hidden {
            object.push_str(" no_image");
        }
        object.push_str(" }\n");
        self.scene.push_str(&object);
        if let Some(Interior::Glass(_)) = look.interior {
            // Light does not pass glass on its way to a surface.
            let _ = writeln!(self.scene, "{shape} {BLACK} no_image no_reflection }}");
        }
    }

    /// Name of the declared part of the mesh; `None` where it is empty.
    fn declare(
        &mut self,
        mesh: &Mesh,
        slot: usize,
        uv_set: Option<u8>,
        listed: Option<&Material>,
    ) -> Result<Option<String>, Error> {
        let Some(part) = Part::new(mesh, slot) else { return Ok(None) };
        if shading::is_bent(mesh) {
            self.looks.notes.approximated(
                format!("mesh `{}`", mesh.name),
                "a normal between those at the corners that turns away from the viewer is turned round: a rim is dark \
                 where it should be lit, where normals and faces are not alike",
            );
        }
        let name = self.names.unique("g", &mesh.name);
        let sdl = match listed {
            None => part.sdl(uv_set, None),
            Some(material) => {
                let (textures, of) = self.vertex_textures(material, &part.colors())?;
                part.sdl(uv_set, Some((&textures, &of)))
            }
        };
        let file = format!("meshes/{name}.inc");
        self.files.push((file.clone(), format!("#declare {name} = {sdl}").into_bytes()));
        let _ = writeln!(self.scene, "#include \"{file}\"");
        Ok(Some(name))
    }

    /// One texture for each colour, and which of them each vertex has. POV-Ray blends between them as the colours.
    fn vertex_textures(
        &mut self,
        material: &Material,
        colors: &[Vec4],
    ) -> Result<(Vec<String>, Vec<usize>), Error> {
        let exact = |c: &Vec4| c.to_array().map(f32::to_bits);
        let distinct: BTreeSet<[u32; 4]> = colors.iter().map(exact).collect();
        let subject = format!("material `{}`", material.name);
        let mut steps = None;
        if distinct.len() > MOST_COLORS {
            let rounded =
                |n: f32| colors.iter().map(|c| exact(&(*c * n).round())).collect::<BTreeSet<_>>().len();
            let n = [255.0, 63.0, 31.0, 15.0, 7.0]
                .into_iter()
                .find(|&n| rounded(n) <= MOST_COLORS)
                .unwrap_or(7.0);
            self.looks.notes.approximated(subject.clone(), format!("colours at the vertices in {n} steps"));
            steps = Some(n);
        }
        if material.alpha != crate::world::Alpha::Opaque && colors.iter().any(|c| c.w != 1.0) {
            self.looks.notes.dropped(subject, "the alpha of the colours at the vertices");
        }
        let (mut textures, mut of, mut known) = (Vec::new(), Vec::new(), HashMap::new());
        for color in colors {
            let color = steps.map_or(*color, |n: f32| (*color * n).round() / n);
            let next = textures.len();
            let index = *known.entry(exact(&color)).or_insert(next);
            if index == next {
                textures.push(self.looks.make(material, Mapping::Given, color.truncate())?.texture);
            }
            of.push(index);
        }
        Ok((textures, of))
    }
}

/// Whether its colour, which vertex colours multiply, has a texture.
fn has_texture(material: &Material) -> bool {
    match &material.surface {
        Surface::Diffuse { color } | Surface::Metal { color, .. } | Surface::Unlit { color } => {
            color.texture.is_some()
        }
        Surface::Dielectric { tint, .. } => tint.texture.is_some(),
        Surface::Pbr(pbr) => pbr.base_color.texture.is_some(),
        Surface::Black | Surface::Layered(_) | Surface::SpecularGlossiness(_) => false,
    }
}
