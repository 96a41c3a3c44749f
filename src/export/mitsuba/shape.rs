//! Spheres, quads and meshes as shapes.
//!
//! Mitsuba's sphere has its poles on Z, and is turned so that its UV is ours; its rectangle has v growing upwards, so that
//! what is textured becomes two triangles. A mesh that is placed several times with the same materials is a shape group,
//! unless it shines, which groups cannot. What shines to both sides is two shapes, one just below the other and facing
//! the other way.

use std::collections::HashMap;

use glam::{Affine2, Affine3A, Mat3A, Vec2, Vec3, Vec3A};

use super::{
    Exporter,
    material::{self, Variant},
    ply::{self, Part},
    xml::Node,
};
use crate::{
    export::Error,
    world::{Alpha, Emission, Instance, Material, MaterialId, Mesh, Quad, Sphere, Surface, TextureRef, Wrap},
};

/// How far below the front the back of a two-sided emitter lies, relative to its size.
const INSET: f32 = 1e-4;

const PLAIN: Variant = Variant { colored: false, mirrored: false };

impl<'a> Exporter<'a> {
    pub fn shapes(&mut self) -> Result<(), Error> {
        let world = self.world;
        for sphere in &world.spheres {
            self.sphere(sphere)?;
        }
        for quad in &world.quads {
            self.quad(quad)?;
        }
        let mut groups: HashMap<(u32, &[MaterialId]), Vec<&Instance>> = HashMap::new();
        let mut order = Vec::new();
        for instance in &world.model.instances {
            let key = (instance.mesh.0, &instance.materials[..]);
            let members = groups.entry(key).or_default();
            if members.is_empty() {
                order.push(key);
            }
            members.push(instance);
        }
        for key in order {
            let members = groups.remove(&key).unwrap_or_default();
            let (alone, together): (Vec<&Instance>, Vec<&Instance>) =
                members.into_iter().partition(|instance| !self.can_share(instance));
            match &together[..] {
                [] => {}
                [one] => self.instance(one)?,
                [first, ..] => self.group(first, &together)?,
            }
            for instance in alone {
                self.instance(instance)?;
            }
        }
        Ok(())
    }

    fn material(&self, id: MaterialId) -> &'a Material {
        &self.world.model.materials[id.index()]
    }

    fn can_share(&self, instance: &Instance) -> bool {
        let mirrors = instance.to_world.matrix3.determinant() < 0.0;
        instance.materials.iter().all(|&id| {
            let material = self.material(id);
            emission(material).is_none() && !(mirrors && material.normal.is_some())
        })
    }

    fn sphere(&mut self, sphere: &Sphere) -> Result<(), Error> {
        let Sphere { center, radius, material } = *sphere;
        let dressed = self.material(material);
        if let Some(light) = emission(dressed)
            && let Some(texture) = &light.color.texture
        {
            let subject = material::subject(dressed);
            if matches!(dressed.surface, Surface::Black | Surface::Unlit { .. })
                && dressed.alpha == Alpha::Opaque
            {
                self.notes.approximated(
                    subject,
                    "the texture of a shining sphere is resampled with its poles on Z, at twice the resolution: Mitsuba \
                     lights wrongly by textured spheres that are turned",
                );
                let radiance = self.polar_radiance("radiance", &light, texture)?;
                let bsdf = Node::reference(&self.bsdf(material, PLAIN)?);
                self.nodes.push(
                    Node::plugin("shape", "sphere")
                        .child(Node::xyz("point", "center", center))
                        .float("radius", radius)
                        .child(bsdf)
                        .child(Node::plugin("emitter", "area").child(radiance)),
                );
                return Ok(());
            }
            self.notes.approximated(subject, "Mitsuba lights wrongly by textured spheres that are turned");
        }
        let shape = |radius: f32| {
            // its X is −X, its Y +Z, its Z +Y
            let axes = Mat3A::from_cols(-radius * Vec3A::X, radius * Vec3A::Z, radius * Vec3A::Y);
            let frame = Affine3A { matrix3: axes, translation: center.into() };
            Node::plugin("shape", "sphere").child(Node::to_world(frame))
        };
        self.place(shape(radius), material, PLAIN, |shape_of_back| {
            shape_of_back.then(|| shape(radius * (1.0 - INSET)))
        })
    }

    fn quad(&mut self, quad: &Quad) -> Result<(), Error> {
        let Quad { origin, u, v, round, material: id } = *quad;
        let Some(normal) = u.cross(v).try_normalize() else { return Ok(()) };
        let material = self.material(id);
        if is_textured(material) && !round {
            let mesh = Mesh {
                name: "quad".into(),
                positions: vec![origin, origin + u, origin + u + v, origin + v],
                uvs: [vec![Vec2::new(0.0, 1.0), Vec2::ONE, Vec2::new(1.0, 0.0), Vec2::ZERO], Vec::new()],
                triangles: vec![[0, 1, 2], [0, 2, 3]],
                ..Mesh::default()
            };
            return self.mesh_part("quad", &mesh, 0, id, None, None, None);
        }
        if round && is_textured(material) {
            self.notes.approximated(
                material::subject(material),
                "textures run round a disk in Mitsuba (u is the radius)",
            );
        }
        if round
            && (u.dot(v).abs() > 1e-3 * u.length() * v.length()
                || (u.length() / v.length() - 1.0).abs() > 1e-3)
        {
            self.notes
                .approximated(material::subject(material), "Mitsuba draws points of an ellipse unevenly");
        }
        let kind = if round { "disk" } else { "rectangle" };
        let shape = |depth: f32| {
            let axes = Mat3A::from_cols(0.5 * Vec3A::from(u), 0.5 * Vec3A::from(v), normal.into());
            let center = origin + 0.5 * (u + v) - depth * normal;
            Node::plugin("shape", kind)
                .child(Node::to_world(Affine3A { matrix3: axes, translation: center.into() }))
        };
        let depth = INSET * u.length().max(v.length());
        self.place(shape(0.0), id, PLAIN, |back| back.then(|| shape(depth)))
    }

    /// A mesh where it stands.
    fn instance(&mut self, instance: &Instance) -> Result<(), Error> {
        let mesh = &self.world.model.meshes[instance.mesh.index()];
        let key = format!("{}", instance.mesh.0);
        for slot in slots(mesh) {
            let Some(&id) = instance.materials.get(usize::from(slot)).or(instance.materials.first()) else {
                continue;
            };
            self.mesh_part(&key, mesh, slot, id, Some(instance.to_world), None, None)?;
        }
        Ok(())
    }

    /// A mesh that stands in several places.
    fn group(&mut self, first: &Instance, all: &[&Instance]) -> Result<(), Error> {
        let mesh = &self.world.model.meshes[first.mesh.index()];
        let key = format!("{}", first.mesh.0);
        let mut parts = Vec::new();
        for slot in slots(mesh) {
            let Some(&id) = first.materials.get(usize::from(slot)).or(first.materials.first()) else {
                continue;
            };
            self.mesh_part(&key, mesh, slot, id, None, None, Some(&mut parts))?;
        }
        if parts.is_empty() {
            return Ok(());
        }
        let group = self.names.unique("g", &mesh.name);
        self.nodes.push(Node::plugin("shape", "shapegroup").attribute("id", &group).children(parts));
        for instance in all {
            self.nodes.push(
                Node::plugin("shape", "instance")
                    .child(Node::reference(&group))
                    .child(Node::to_world(instance.to_world)),
            );
        }
        Ok(())
    }

    /// The triangles of one slot: one shape, or one for each handedness of the normal map. They go into `group`, if given.
    #[allow(clippy::too_many_arguments)]
    fn mesh_part(
        &mut self,
        mesh_key: &str,
        mesh: &Mesh,
        slot: u16,
        id: MaterialId,
        to_world: Option<Affine3A>,
        handedness: Option<f32>,
        mut group: Option<&mut Vec<Node>>,
    ) -> Result<(), Error> {
        let material = self.material(id);
        let turned = to_world.is_some_and(|m| m.matrix3.determinant() < 0.0);
        if material.normal.is_some() && handedness.is_none() {
            for sign in [1.0, -1.0] {
                self.mesh_part(mesh_key, mesh, slot, id, to_world, Some(sign), group.as_deref_mut())?;
            }
            return Ok(());
        }
        let colored = material.vertex_colors && !mesh.colors.is_empty();
        let factor = material::base(material).map_or(Vec3::ONE, |color| color.factor);
        let uv_set = self.uv_set(material, mesh);
        let part = Part {
            slot,
            uv_set,
            uv_shift: self.uv_shift(material, mesh, uv_set),
            colors: colored.then_some((factor, material.coverage.factor)),
            handedness,
            inset: 0.0,
            // Mitsuba turns normals over where a transform mirrors.
            to_world: to_world.filter(|_| turned),
        };
        let placed = to_world.filter(|_| !turned && to_world != Some(Affine3A::IDENTITY));
        // cross(normal, ∂p/∂u) turns over with a mirror
        let sign = if turned { -1.0 } else { 1.0 };
        let variant = Variant { colored, mirrored: handedness.is_some_and(|h| h * sign < 0.0) };
        let Some(front) = self.ply(mesh_key, mesh, &part, placed)? else { return Ok(()) };
        if let Some(group) = &mut group {
            let bsdf = self.bsdf(id, variant)?;
            group.push(front.child(Node::reference(&bsdf)));
            return Ok(());
        }
        let back = match emission(material) {
            Some(light) if light.two_sided => {
                self.ply(mesh_key, mesh, &Part { inset: INSET, ..part }, placed)?
            }
            _ => None,
        };
        if let Some(light) = emission(material)
            && light.color.texture.is_some()
        {
            self.check_parameters(material, mesh, &light.color.texture, &part);
        }
        self.place(front, id, variant, |wanted| back.filter(|_| wanted))
    }

    /// A `ply` shape, without material.
    fn ply(
        &mut self,
        mesh_key: &str,
        mesh: &Mesh,
        part: &Part,
        placed: Option<Affine3A>,
    ) -> Result<Option<Node>, Error> {
        let key = format!("{mesh_key} {part:?}");
        let known = if mesh_key == "quad" { None } else { self.meshes.get(&key).cloned() };
        let (file, normals) = match known {
            Some(known) => known,
            None => {
                let Some(ply) = ply::encode(mesh, part) else { return Ok(None) };
                let name = self.names.unique("s", &mesh.name);
                let file = format!("meshes/{name}.ply");
                self.out.write(&file, &ply.bytes)?;
                self.meshes.insert(key, (file.clone(), ply.normals));
                (file, ply.normals)
            }
        };
        let mut shape = Node::plugin("shape", "ply").string("filename", &file);
        if !normals {
            shape = shape.boolean("face_normals", true);
        }
        if let Some(placed) = placed {
            shape = shape.child(Node::to_world(placed));
        }
        Ok(Some(shape))
    }

    /// Dresses a shape and puts it into the scene, with its back where that shines too.
    fn place(
        &mut self,
        front: Node,
        id: MaterialId,
        variant: Variant,
        back: impl FnOnce(bool) -> Option<Node>,
    ) -> Result<(), Error> {
        let material = self.material(id);
        let bsdf = Node::reference(&self.bsdf(id, variant)?);
        let Some(light) = emission(material) else {
            self.nodes.push(front.child(bsdf));
            return Ok(());
        };
        let radiance = self.radiance("radiance", &light.color, light.strength)?;
        if matches!(material.surface, Surface::Unlit { .. }) {
            self.notes.approximated(
                material::subject(material),
                "an unlit surface is one that gives off its colour and absorbs all else: unlike here it lights others and casts \
                 shadows",
            );
            if material.vertex_colors && variant.colored {
                self.notes.approximated(
                    material::subject(material),
                    "vertex colours are left out: Mitsuba's emitters cannot have them",
                );
            }
        }
        let emitter = Node::plugin("emitter", "area").child(radiance);
        if let Some(back) = back(light.two_sided) {
            let back = back.boolean("flip_normals", true);
            self.nodes.push(back.child(bsdf.clone()).child(emitter.clone()));
        }
        self.nodes.push(front.child(bsdf).child(emitter));
        Ok(())
    }

    /// Mitsuba's meshes have one UV set.
    fn uv_set(&mut self, material: &Material, mesh: &Mesh) -> u8 {
        let used = textures(material);
        let Some(first) = used.first() else { return 0 };
        let set = first.uv_set & 1;
        let both = mesh.uvs.iter().all(|uvs| !uvs.is_empty());
        if both && used.iter().any(|t| t.uv_set & 1 != set) {
            self.notes.approximated(
                material::subject(material),
                format!("all its textures lie on UV set {set}: Mitsuba's meshes have one"),
            );
        }
        set
    }

    /// The whole textures by which UVs may be moved, for an emitter whose UVs ought to lie in the unit square.
    fn uv_shift(&self, material: &Material, mesh: &Mesh, uv_set: u8) -> Vec2 {
        let textured = emission(material).is_some_and(|light| light.color.texture.is_some());
        let repeats = |t: &TextureRef| {
            let texture = self.texture(t);
            let plain = t.transform == Affine2::IDENTITY;
            plain && texture.wrap_u == Wrap::Repeat && texture.wrap_v == Wrap::Repeat
        };
        if !textured || !textures(material).iter().all(repeats) {
            return Vec2::ZERO;
        }
        let least = ply::set(mesh, uv_set).iter().fold(Vec2::MAX, |least, &uv| least.min(uv));
        if least.is_finite() { least.floor() } else { Vec2::ZERO }
    }

    /// Mitsuba picks points of a textured emitter by UV, and must find them.
    fn check_parameters(
        &mut self,
        material: &Material,
        mesh: &Mesh,
        texture: &Option<TextureRef>,
        part: &Part,
    ) {
        let uvs = ply::set(mesh, part.uv_set);
        let moved = |uv: &Vec2| *uv - part.uv_shift;
        let unit = uvs.iter().map(moved).all(|uv| uv.min_element() >= 0.0 && uv.max_element() <= 1.0);
        let covered: f32 = mesh
            .triangles
            .iter()
            .filter_map(|t| {
                let [a, b, c] = t.map(|i| uvs.get(i as usize).copied());
                let (a, b, c) = (a?, b?, c?);
                Some(0.5 * (b - a).perp_dot(c - a).abs())
            })
            .sum();
        let whole = texture.is_none_or(|t| t.transform == Affine2::IDENTITY);
        if !unit || covered > 1.001 || !whole {
            self.notes.approximated(
                material::subject(material),
                "Mitsuba picks points of a textured emitter by their UV: where UVs overlap or leave the unit square, part of the \
                 light is lost",
            );
        }
    }
}

/// What a material gives off, unlit colours included.
pub fn emission(material: &Material) -> Option<Emission> {
    match &material.surface {
        Surface::Unlit { color } => Some(Emission { color: *color, strength: 1.0, two_sided: true }),
        _ => material.emission.filter(|e| e.strength > 0.0 && e.color.factor != Vec3::ZERO),
    }
}

/// Every texture of a material, the base colour's first.
pub fn textures(material: &Material) -> Vec<TextureRef> {
    let mut all = Vec::new();
    all.extend(material::base(material).and_then(|color| color.texture));
    match &material.surface {
        Surface::Pbr(pbr) => {
            all.extend([pbr.metallic, pbr.roughness].iter().filter_map(|s| s.texture.map(|(t, _)| t)));
        }
        Surface::Metal { finish: crate::world::MetalFinish::Roughness { roughness, .. }, .. }
        | Surface::Dielectric { roughness, .. } => all.extend(roughness.texture.map(|(t, _)| t)),
        _ => {}
    }
    all.extend(material.normal.map(|map| map.texture));
    all.extend(material.emission.and_then(|e| e.color.texture));
    if material.alpha != Alpha::Opaque {
        all.extend(material.coverage.texture.map(|(t, _)| t));
    }
    all
}

fn is_textured(material: &Material) -> bool {
    !textures(material).is_empty()
}

fn slots(mesh: &Mesh) -> Vec<u16> {
    let mut slots = mesh.slots.clone();
    slots.push(if mesh.slots.is_empty() { 0 } else { mesh.slots[0] });
    slots.sort_unstable();
    slots.dedup();
    slots
}
