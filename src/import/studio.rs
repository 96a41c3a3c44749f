//! The built-in studio, for an asset without a scene: a backdrop, three soft lights, a dim surrounding.
//!
//! Everything is sized by the asset: R is the radius of the sphere about its bounding box. The lights are placed by
//! where the camera stands: the key to its upper left, the fill to its right, the rim behind the asset; each faces the
//! asset and is moved outwards (growing, so that it gives the same light) until the camera does not see it. Their
//! radiance is set so that a grey of 0.5 that faces camera and key shows as about 0.45.
//!
//! An asset that brings lights of its own, strong enough to be seen by, is shown in these and a dimmer surrounding: soft
//! lights and backdrop would stand in their way.

use std::{
    f64::consts::{FRAC_PI_2, PI},
    path::Path,
};

use glam::{Affine3A, DVec2, DVec3, Vec3};

use super::{
    bounds::Bounds,
    cameras,
    framing::{self, Subject},
    model_while,
};
use crate::{
    color::luminance,
    diagnostic::{Diagnostic, Place},
    scene::Selection,
    world::{
        Camera, ColorInput, Emission, Environment, EnvironmentKind, Instance, Light, Material, MaterialId,
        Mesh, MeshId, Model, Projection, Quad, Surface, World,
    },
};

/// Reflectance of the backdrop.
const BACKDROP: f32 = 0.5;

/// Radiance of the surrounding, from below and from above.
const SURROUNDING: [f32; 2] = [0.1, 0.35];

/// Factor on the surrounding of an asset that brings lights.
const DIMMED: f32 = 0.25;

/// What the asset's own lights give it, in W/m²: the least to be seen by, a tenth of what the studio gives …
const ENOUGH: f64 = 0.3;
/// … and the most without a warning: a grey of 0.5 is brighter than white.
const BLINDING: f64 = 10.0;

/// A light by where it stands: components along the camera's right, world up, and away from the camera.
struct SoftLight {
    name: &'static str,
    direction: [f64; 3],
    /// In R.
    distance: f64,
    side: f64,
    /// On a surface at the asset that faces it, in π W/m².
    irradiance: f64,
}

const LIGHTS: [SoftLight; 3] = [
    SoftLight { name: "key", direction: [-0.6, 0.7, -0.6], distance: 4.0, side: 2.6, irradiance: 0.75 },
    SoftLight { name: "fill", direction: [0.85, 0.45, -0.5], distance: 4.0, side: 2.2, irradiance: 0.18 },
    SoftLight { name: "rim", direction: [0.3, 0.85, 0.6], distance: 4.0, side: 2.0, irradiance: 0.5 },
];

/// Segments of the backdrop's bend.
const ARC: u32 = 32;

/// How often a light is moved outwards before it is given up.
const MOVES: u32 = 40;

/// The asset at `path` in the studio, for a picture of this size in pixels: seen by its own camera, that which is called
/// `camera` where a name is given, or else one that frames it. One with a surrounding of its own is shown in that. And what
/// `meanwhile` makes of the asset (see [`model_while`]), whose meshes are the first of the world's.
pub fn bare_asset<T: Send>(
    path: &Path,
    size: [u32; 2],
    selection: &Selection,
    camera: Option<&str>,
    meanwhile: impl Fn(&Model) -> T + Sync,
) -> Result<(World, T), Vec<Diagnostic>> {
    let (mut model, made) = model_while(path, selection, meanwhile)?;
    let shows = |instance: &Instance| {
        let mesh = &model.meshes[instance.mesh.index()];
        mesh.triangles.iter().any(|t| t.iter().all(|&i| mesh.positions[i as usize].is_finite()))
    };
    if !model.instances.iter().any(shows) {
        let nothing = Diagnostic::error(path, Place::File, "there is nothing to be seen in this file")
            .help("it has no triangles that can be drawn, or no scene that shows them");
        model.warnings.push(nothing);
        return Err(model.warnings);
    }
    let aspect = f64::from(size[0].max(1)) / f64::from(size[1].max(1));
    let mut world = World {
        model,
        spheres: Vec::new(),
        quads: Vec::new(),
        environment: surrounding(),
        camera: framing::frame(&Subject::boxed(Bounds::UNIT), framing::USUAL, aspect as f32),
    };
    let subject = Subject::of(&world);
    let bounds = subject.bounds;
    world.camera = match world.model.cameras.first() {
        Some(_) => cameras::find(&world.model.cameras, camera, path, &Place::File)
            .map_err(|error| vec![error])?
            .clone(),
        None if camera.is_some() => {
            let error = cameras::find(&[], camera, path, &Place::File).err();
            return Err(error.into_iter().collect());
        }
        None => framing::frame(&subject, framing::USUAL, aspect as f32),
    };
    let own = own_light(&world.model.lights, &bounds);
    if let Some(surrounding) = &world.model.environment {
        world.environment = surrounding.clone();
    } else if own < ENOUGH {
        furnish(&mut world, &bounds, aspect);
    } else {
        world.environment.strength = DIMMED;
    }
    if own > BLINDING {
        let stops = -(own / PI).log2().round();
        let message =
            format!("the asset's own lights give it some {own:.0} W/m²: the picture will be too bright");
        let warning = Diagnostic::warning(path, Place::File, message)
            .help(format!("darken it with `--exposure {stops}`, or light it in a scene file"));
        world.model.warnings.push(warning);
    }
    Ok((world, made))
}

/// Irradiance at the middle of the asset, at a surface that faces each light, without shadows or the edges of cones. A
/// light within the asset counts as if it stood at its rim.
fn own_light(lights: &[Light], bounds: &Bounds) -> f64 {
    let from = |light: &Light| match *light {
        Light::Point { position, intensity } | Light::Spot { position, intensity, .. } => {
            let distance = position.as_dvec3().distance(bounds.center()).max(bounds.radius());
            f64::from(luminance(intensity)) / distance.powi(2)
        }
        Light::Sun { irradiance, .. } => luminance(irradiance).into(),
    };
    lights.iter().map(from).sum()
}

fn surrounding() -> Environment {
    let [bottom, top] = SURROUNDING.map(Vec3::splat);
    Environment {
        kind: EnvironmentKind::Gradient { bottom, top },
        strength: 1.0,
        rotation: 0.0,
        visible: true,
    }
}

/// Adds lights and backdrop around what is within `bounds`.
fn furnish(world: &mut World, bounds: &Bounds, aspect: f64) {
    let eye = Eye::new(&world.camera, aspect);
    // An interior: a studio around it would not light it.
    if bounds.contains(eye.position) {
        world.environment.kind = EnvironmentKind::Color(Vec3::ONE);
        return;
    }
    let set = Set::around(bounds, &eye);
    let mut depth = 3.0 * set.radius;
    for light in &LIGHTS {
        let Some([origin, u, v]) = set.out_of_sight(light, &eye) else {
            continue;
        };
        for corner in [origin, origin + u, origin + v, origin + u + v] {
            depth = depth.max((corner - set.center).dot(set.away));
        }
        let strength = light.irradiance * PI * (light.distance / light.side).powi(2);
        let emission =
            Emission { color: ColorInput::constant(Vec3::ONE), strength: strength as f32, two_sided: false };
        let material = Material { emission: Some(emission), ..Material::new(light.name, Surface::Black) };
        let material = add_material(world, material);
        let [origin, u, v] = [origin, u, v].map(|p| p.as_vec3());
        world.quads.push(Quad { origin, u, v, round: false, material });
    }
    // From below its floor a camera would see nothing else.
    if eye.position.y > set.floor {
        let color = ColorInput::constant(Vec3::splat(BACKDROP));
        let material = add_material(world, Material::new("studio backdrop", Surface::Diffuse { color }));
        world.model.meshes.push(set.backdrop(&eye, 1.2 * depth));
        world.model.instances.push(Instance {
            name: "studio backdrop".into(),
            mesh: MeshId(world.model.meshes.len() as u32 - 1),
            to_world: Affine3A::IDENTITY,
            materials: vec![material],
        });
    }
}

fn add_material(world: &mut World, material: Material) -> MaterialId {
    world.model.materials.push(material);
    MaterialId(world.model.materials.len() as u32 - 1)
}

/// What the camera sees, as a pyramid or a box without end.
struct Eye {
    position: DVec3,
    right: DVec3,
    up: DVec3,
    forward: DVec3,
    /// Half the width and height of the picture, at distance 1 in perspective.
    half: DVec2,
    perspective: bool,
}

impl Eye {
    fn new(camera: &Camera, aspect: f64) -> Self {
        let axes = camera.to_world.matrix3;
        let (high, perspective) = match camera.projection {
            Projection::Perspective { vfov } => ((f64::from(vfov) / 2.0).tan(), true),
            Projection::Orthographic { half_height } => (f64::from(half_height), false),
        };
        Self {
            position: camera.to_world.translation.as_dvec3(),
            right: axes.x_axis.as_dvec3(),
            up: axes.y_axis.as_dvec3(),
            forward: -axes.z_axis.as_dvec3(),
            half: DVec2::new(high * aspect, high),
            perspective,
        }
    }

    /// `false`: these corners of something convex are all on the outer side of one side of the frame, or behind.
    fn may_see(&self, corners: &[DVec3]) -> bool {
        let local: Vec<DVec3> = corners
            .iter()
            .map(|corner| corner - self.position)
            .map(|p| DVec3::new(p.dot(self.right), p.dot(self.up), p.dot(self.forward)))
            .collect();
        let half = |depth: f64| if self.perspective { self.half * depth } else { self.half };
        let out: [&dyn Fn(&DVec3) -> bool; 5] = [
            &|p| p.z <= 0.0,
            &|p| p.x > half(p.z).x,
            &|p| p.x < -half(p.z).x,
            &|p| p.y > half(p.z).y,
            &|p| p.y < -half(p.z).y,
        ];
        !out.iter().any(|out| local.iter().all(out))
    }

    /// The rays through the corners of the picture: origin and direction.
    fn corner_rays(&self) -> [(DVec3, DVec3); 4] {
        [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)].map(|(x, y)| {
            let offset = x * self.half.x * self.right + y * self.half.y * self.up;
            if self.perspective {
                (self.position, self.forward + offset)
            } else {
                (self.position + offset, self.forward)
            }
        })
    }
}

/// Where the asset is and how the studio is turned.
struct Set {
    center: DVec3,
    radius: f64,
    /// Height of the floor.
    floor: f64,
    /// Horizontal, away from the camera.
    away: DVec3,
    /// Horizontal, to the camera's right.
    right: DVec3,
}

impl Set {
    fn around(bounds: &Bounds, eye: &Eye) -> Self {
        let (center, radius) = (bounds.center(), bounds.radius());
        let level = |d: DVec3| d.reject_from(DVec3::Y).try_normalize();
        // Straight down and straight up, the top of the picture is what lies farther away, or nearer.
        let looks_down = eye.forward.y < 0.0;
        let away = if eye.forward.y.abs() < 0.999 {
            level(eye.forward)
        } else {
            level(if looks_down { eye.up } else { -eye.up })
        };
        let away = away.unwrap_or(DVec3::NEG_Z);
        // A hair below, so that a flat bottom does not lie in the floor.
        let floor = bounds.min.y - 1e-3 * radius;
        Self { center, radius, floor, away, right: away.cross(DVec3::Y) }
    }

    /// Corner and edges of a light where the camera does not see it; `None` where that cannot be.
    fn out_of_sight(&self, light: &SoftLight, eye: &Eye) -> Option<[DVec3; 3]> {
        let [right, up, away] = light.direction;
        let direction = (right * self.right + up * DVec3::Y + away * self.away).normalize();
        (0..MOVES).map(|moves| self.radius * 1.25f64.powi(moves as i32)).find_map(|scale| {
            let facing = -direction;
            let across = DVec3::Y.cross(facing).normalize();
            let (u, v) = (across * light.side * scale, facing.cross(across) * light.side * scale);
            let origin = self.center + direction * light.distance * scale - (u + v) / 2.0;
            let corners = [origin, origin + u, origin + v, origin + u + v];
            (!eye.may_see(&corners)).then_some([origin, u, v])
        })
    }

    /// A floor that bends into a wall at `depth` behind the asset, wide and high enough to fill the picture.
    fn backdrop(&self, eye: &Eye, depth: f64) -> Mesh {
        let bend = 0.65 * depth;
        let toward = (self.center - eye.position).dot(self.away).max(0.0);
        let front = -(toward + 4.0 * self.radius);
        let largest = 20.0 * (toward + depth);
        let (mut half_width, mut height) = (4.0 * self.radius, 1.5 * bend);
        for (origin, direction) in eye.corner_rays() {
            let t = (depth - (origin - self.center).dot(self.away)) / direction.dot(self.away);
            // A ray that never comes to the wall meets the floor, or the surrounding.
            let wall = origin + if t > 0.0 { t.min(1e9 * self.radius) } else { 0.0 } * direction;
            half_width = half_width.max(1.1 * (wall - self.center).dot(self.right).abs());
            height = height.max(1.1 * (wall.y - self.floor));
        }
        let (half_width, height) = (half_width.min(largest), height.min(largest));

        // (distance behind the asset, height above the floor), and the normal in the same plane.
        let arc = (0..=ARC).map(|i| {
            let (sin, cos) = (FRAC_PI_2 * f64::from(i) / f64::from(ARC)).sin_cos();
            (DVec2::new(depth - bend + bend * sin, bend - bend * cos), DVec2::new(-sin, cos))
        });
        let profile = std::iter::once((DVec2::new(front, 0.0), DVec2::Y))
            .chain(arc)
            .chain([(DVec2::new(depth, height), DVec2::NEG_X)]);

        let mut mesh = Mesh { name: "studio backdrop".into(), ..Mesh::default() };
        for (p, n) in profile {
            let normal = n.x * self.away + n.y * DVec3::Y;
            for side in [-half_width, half_width] {
                let level = self.center + side * self.right + p.x * self.away;
                mesh.positions.push(DVec3::new(level.x, self.floor + p.y, level.z).as_vec3());
                mesh.normals.push(normal.as_vec3());
            }
        }
        for left in (0..mesh.positions.len() as u32 - 2).step_by(2) {
            mesh.triangles.extend([[left, left + 1, left + 3], [left, left + 3, left + 2]]);
        }
        mesh
    }
}

#[cfg(test)]
mod tests;
