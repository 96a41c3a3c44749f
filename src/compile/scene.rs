//! The scene that the integrator sees: what a ray meets, and the material and light at that point.

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3, Vec3A, Vec4};
use serde::Serialize;

use super::object::{Object, ObjectKind, Placement};
use crate::{
    accel::{Accel, Hit},
    camera::{Camera, FilterTable},
    geometry::{Ray, offset},
    light::{Aim, Lights},
    material::{self, Needs, SurfacePoint},
    render::Bounces,
    sampling::weave::Weave,
    texture::Textures,
    world::{Material, MaterialId, Mesh, Surface},
};

/// Counts, sizes and times of what was built.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct SceneStats {
    /// Of all meshes, each counted once however often it is placed.
    pub triangles: u64,
    pub meshes: u64,
    pub instances: u64,
    pub spheres: u64,
    pub quads: u64,
    /// Those with a place or a direction: lamps and emissive surfaces.
    pub lights: u64,
    /// Whether the surroundings give light.
    pub environment: bool,
    pub materials: u64,
    pub textures: u64,
    pub bvh_seconds: f64,
    pub bvh_bytes: u64,
    pub geometry_bytes: u64,
    pub texture_bytes: u64,
    /// Triangles without area or with corners that are not finite or too far away.
    pub triangles_set_aside: u64,
    /// Objects without a finite extent, instances of empty meshes among them.
    pub objects_set_aside: u64,
    /// Texels of the environment's image that were negative or not finite, and are black.
    pub environment_texels_set_aside: u64,
}

impl SceneStats {
    /// What is not rendered as it was described, one sentence each.
    pub fn notices(&self) -> Vec<String> {
        let notices = [
            (self.triangles_set_aside, "triangles have no area or corners out of reach, and were left out"),
            (self.objects_set_aside, "objects are empty, flat or out of reach, and were left out"),
            (
                self.environment_texels_set_aside,
                "texels of the environment are negative or not finite, and are black",
            ),
        ];
        notices
            .iter()
            .filter(|(count, _)| *count > 0)
            .map(|(count, what)| format!("{count} {what}"))
            .collect()
    }
}

#[derive(Debug)]
pub struct Scene {
    pub accel: Accel,
    pub objects: Vec<Object>,
    pub meshes: Vec<Mesh>,
    pub materials: Vec<Material>,
    pub textures: Textures,
    pub lights: Lights,
    /// Where light is focused by mirrors and glass: the lamps and their directions towards those.
    pub aim: Option<Aim>,
    /// Paths from lamps, over the whole picture, for each path through a pixel.
    pub lamp_paths: f32,
    /// Paths that the first surface lit from afar sends on for each that arrives there; at least one.
    pub branches: u32,
    /// x, y, width, height of the part of the picture that is rendered.
    pub window: [u32; 4],
    pub camera: Camera,
    pub filter: FilterTable,
    pub seed: u64,
    /// How the points of neighbouring pixels go together.
    pub weave: Weave,
    pub bounces: Bounces,
    pub stats: SceneStats,
}

impl Scene {
    pub fn material(&self, hit: &Hit) -> &Material {
        &self.materials[self.material_id(hit).index()]
    }

    pub fn material_id(&self, hit: &Hit) -> MaterialId {
        let object = &self.objects[hit.object as usize];
        if let [only] = *object.materials {
            return only;
        }
        let slot = match &object.kind {
            ObjectKind::Instance { mesh, .. } => {
                let slots = &self.meshes[mesh.index()].slots;
                slots.get(hit.primitive as usize).map_or(0, |&slot| usize::from(slot))
            }
            _ => 0,
        };
        *object.materials.get(slot).unwrap_or(&object.materials[0])
    }

    /// Whether the camera sees a hit: backs of single-sided surfaces it does not.
    pub fn shows(&self, ray: &Ray, hit: &Hit) -> bool {
        self.material(hit).double_sided || ray.direction.dot(self.normal(ray, hit)) <= 0.0
    }

    /// Geometric normal: outward, of any length.
    fn normal(&self, ray: &Ray, hit: &Hit) -> Vec3 {
        match &self.objects[hit.object as usize].kind {
            ObjectKind::Instance { mesh, placement } => {
                let mesh = &self.meshes[mesh.index()];
                let [i, j, k] = mesh.triangles[hit.primitive as usize];
                let positions = &mesh.positions;
                let p0 = positions[i as usize];
                let n = (positions[j as usize] - p0).cross(positions[k as usize] - p0);
                placement.normal(n.into()).into()
            }
            ObjectKind::Sphere { center, .. } => ray.at(hit.t) - center,
            ObjectKind::Quad { normal, .. } => *normal,
        }
    }

    /// The light that a hit primitive is, if it is one.
    pub fn emitter(&self, hit: &Hit) -> Option<u32> {
        self.objects[hit.object as usize].emitter(hit.primitive)
    }

    /// UVs and vertex colour at a hit: what coverage and emission depend on. (As all that follows, no more than the object's
    /// materials need; the rest is zero, or one.)
    pub fn uvs_and_color(&self, ray: &Ray, hit: &Hit) -> ([Vec2; 2], Vec4) {
        let object = &self.objects[hit.object as usize];
        let normal = match &object.kind {
            ObjectKind::Sphere { center, radius } if object.needs.uvs => (ray.at(hit.t) - center) / *radius,
            _ => Vec3::ZERO,
        };
        self.uvs_and_color_at(hit, normal)
    }

    /// The share of what is behind that a hit hides. Unlit surfaces are there for camera rays alone.
    pub fn coverage(&self, ray: &Ray, hit: &Hit, from_camera: bool) -> f32 {
        let material = self.material(hit);
        if !from_camera && matches!(material.surface, Surface::Unlit { .. }) {
            return 0.0;
        }
        let (uvs, color) = self.uvs_and_color(ray, hit);
        material::coverage(material, &self.textures, &uvs, color)
    }

    /// The share of light that passes a hit on its way along `ray` without being scattered: beside the surface where it
    /// does not cover all, and through it where it is a smooth wall without thickness.
    pub fn passed(&self, ray: &Ray, hit: &Hit) -> (f32, Vec3) {
        let hidden = self.coverage(ray, hit, false);
        let material = self.material(hit);
        if hidden == 0.0 || !material::is_wall(material) {
            return (1.0 - hidden, Vec3::ZERO);
        }
        let point = self.surface_point(ray, hit);
        let wo = -ray.direction.normalize_or_zero();
        (1.0 - hidden, hidden * material::passed_straight(material, &self.textures, &point, wo))
    }

    /// Radiance that an emitting surface sends from a point with these coordinates, in a direction of this cosine with
    /// its outward normal.
    #[inline]
    pub fn emission(&self, hit: &Hit, uvs: &[Vec2; 2], cos: f32) -> Vec3 {
        if !self.objects[hit.object as usize].emits {
            return Vec3::ZERO;
        }
        self.emission_of(self.material(hit), uvs, cos)
    }

    fn emission_of(&self, material: &Material, uvs: &[Vec2; 2], cos: f32) -> Vec3 {
        match &material.emission {
            Some(emission) => {
                material::emission_passed(material, &self.textures, uvs, cos)
                    * material::emission(emission, &self.textures, uvs, cos > 0.0)
            }
            None => Vec3::ZERO,
        }
    }

    /// As [`emission`](Self::emission) of a point on a light that was chosen, not hit, times the share of the surface that is
    /// there: rays that meet it by chance pass the rest. `hit.u` and `hit.v` are as a hit has them, but on a sphere,
    /// where the normal says where the point is.
    pub fn emission_of_light(&self, hit: &Hit, normal: Vec3, cos: f32) -> Vec3 {
        let material = self.material(hit);
        let (uvs, color) = self.uvs_and_color_at(hit, normal);
        let coverage = material::coverage(material, &self.textures, &uvs, color);
        coverage * self.emission_of(material, &uvs, cos)
    }

    /// `normal` is of use on spheres alone.
    fn uvs_and_color_at(&self, hit: &Hit, normal: Vec3) -> ([Vec2; 2], Vec4) {
        let Object { kind, needs, .. } = &self.objects[hit.object as usize];
        let mut found = ([Vec2::ZERO; 2], Vec4::ONE);
        match kind {
            ObjectKind::Instance { mesh, .. } if needs.uvs || needs.color => {
                let mesh = &self.meshes[mesh.index()];
                let (corners, b) = (mesh.triangles[hit.primitive as usize], Vec2::new(hit.u, hit.v));
                if needs.uvs {
                    found.0 = mesh.uvs_at(corners, b);
                }
                if needs.color {
                    found.1 = mesh.color_at(corners, b);
                }
            }
            ObjectKind::Sphere { .. } if needs.uvs => found.0 = [sphere_uv(normal); 2],
            ObjectKind::Quad { .. } => found.0 = [Vec2::new(hit.u, 1.0 - hit.v); 2],
            ObjectKind::Instance { .. } | ObjectKind::Sphere { .. } => {}
        }
        found
    }

    /// Position, normals and texture coordinates of a hit.
    pub fn surface_point(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        let Object { kind, needs, .. } = &self.objects[hit.object as usize];
        match kind {
            ObjectKind::Instance { mesh, placement } => {
                mesh_point(&self.meshes[mesh.index()], placement, hit, *needs)
            }
            ObjectKind::Sphere { center, radius } => {
                let n = (ray.at(hit.t) - center).normalize_or(Vec3::Y);
                let position = center + radius * n;
                let error = offset::sphere_error(*center, *radius, position);
                let uv = if needs.uvs { sphere_uv(n) } else { Vec2::ZERO };
                let east = || Vec3::new(n.z, 0.0, -n.x);
                plain_point(position, error, n, needs.tangent.then(east), uv)
            }
            ObjectKind::Quad { origin, u, v, normal, .. } => {
                let position = origin + hit.u * u + hit.v * v;
                let error = offset::quad_error(*origin, *u, *v, hit.u, hit.v);
                let uv = Vec2::new(hit.u, 1.0 - hit.v);
                plain_point(position, error, *normal, needs.tangent.then_some(*u), uv)
            }
        }
    }
}

/// An analytic surface: its geometric normal is its shading normal. `east` is the direction in which u grows, of any length;
/// the bitangent points where v falls, up in the picture, as normal maps want it.
fn plain_point(position: Vec3, error: Vec3, n: Vec3, east: Option<Vec3>, uv: Vec2) -> SurfacePoint {
    let tangent = east.map_or(Vec4::ZERO, |east| east.normalize_or_zero().extend(1.0));
    SurfacePoint { position, error, ng: n, ns: n, tangent, uvs: [uv; 2], color: Vec4::ONE }
}

fn mesh_point(mesh: &Mesh, placement: &Placement, hit: &Hit, needs: Needs) -> SurfacePoint {
    let Placement { to_world, to_object, handedness, .. } = placement;
    let corners = mesh.triangles[hit.primitive as usize];
    let [i, j, k] = [corners[0] as usize, corners[1] as usize, corners[2] as usize];
    let at = |i: usize| Vec3A::from(mesh.positions[i]);
    let (p0, p1, p2) = (at(i), at(j), at(k));
    let b = Vec2::new(hit.u, hit.v);
    let b0 = 1.0 - b.x - b.y;
    let local = b0 * p0 + b.x * p1 + b.y * p2;
    let error = offset::triangle_error([p0, p1, p2], b.x, b.y);
    let error = offset::instance_error(to_world, to_object, local, error);
    let ng = unit(placement.normal((p1 - p0).cross(p2 - p0))).unwrap_or(Vec3A::Y);
    let ns = match &mesh.normals[..] {
        [] => ng,
        n => {
            let n = b0 * Vec3A::from(n[i]) + b.x * Vec3A::from(n[j]) + b.y * Vec3A::from(n[k]);
            unit(placement.normal(n)).unwrap_or(ng)
        }
    };
    let ns = if ns.dot(ng) < 0.0 { -ns } else { ns };
    let uvs = if needs.uvs { mesh.uvs_at(corners, b) } else { [Vec2::ZERO; 2] };
    let tangent = || {
        let tangent = match &mesh.tangents[..] {
            [] => flat_tangent(mesh, corners, [p0.into(), p1.into(), p2.into()]),
            t => b0 * t[i] + b.x * t[j] + b.y * t[k],
        };
        let direction = unit(to_world.transform_vector3a(Vec3A::from_vec4(tangent))).unwrap_or(Vec3A::ZERO);
        direction.extend(handedness * tangent.w.signum())
    };
    SurfacePoint {
        position: to_world.transform_point3a(local).into(),
        error: error.into(),
        ng: ng.into(),
        ns: ns.into(),
        tangent: if needs.tangent { tangent() } else { Vec4::ZERO },
        uvs,
        color: if needs.color { mesh.color_at(corners, b) } else { Vec4::ONE },
    }
}

/// `v` of length 1, unless it is too short or too long to tell.
#[inline(always)]
fn unit(v: Vec3A) -> Option<Vec3A> {
    let square = v.length_squared();
    (square > 0.0 && square < f32::INFINITY).then(|| v * (1.0 / square.sqrt()))
}

/// ∂p/∂u of the triangle, and the sign that makes the bitangent point where v falls (up in the picture); zero where the
/// UVs are degenerate.
fn flat_tangent(mesh: &Mesh, corners: [u32; 3], [p0, p1, p2]: [Vec3; 3]) -> Vec4 {
    let uvs = if mesh.uvs[0].is_empty() { &mesh.uvs[1] } else { &mesh.uvs[0] };
    if uvs.is_empty() {
        return Vec4::ZERO;
    }
    let [a, b, c] = corners.map(|i| uvs[i as usize]);
    let (d1, d2) = (b - a, c - a);
    let (e1, e2) = (p1 - p0, p2 - p0);
    let determinant = d1.perp_dot(d2);
    if determinant == 0.0 || !determinant.is_finite() {
        return Vec4::ZERO;
    }
    let along_u = (d2.y * e1 - d1.y * e2) / determinant;
    // u × (−v) turns with the normal where the UVs are laid out mirrored
    along_u.normalize_or_zero().extend(-determinant.signum())
}

/// Where a sphere's outward normal lies on its texture, which reads the right way round from outside (an environment map
/// is seen from inside: its u runs the other way).
fn sphere_uv(n: Vec3) -> Vec2 {
    Vec2::new(0.5 - n.z.atan2(n.x) / TAU, n.y.clamp(-1.0, 1.0).acos() / PI)
}
