//! Path tracing: from the camera into the scene, at every vertex light gathered by two strategies, weighed against
//! each other (Veach 1997, chapters 8 to 10).
//!
//! ```text
//! L = Σ over vertices:  emission met by chance × w_bsdf  +  light chosen on purpose × w_light
//! ```
//!
//! with the power heuristic for w. Vertices whose BSDF is a delta cannot choose a light, and what they meet weighs 1.
//! The first surface that spreads light from afar may send several paths on, which share the way to it ([`Scene::branches`]); and where
//! the camera sees the rim of a lamp, more rays than the path's look for what is directly visible (`rims`).
//!
//! Paths end by the bounce limits of [`Bounces`](crate::render::Bounces) (emission found by the last ray still counts) or by Russian
//! roulette on the throughput, which leaves the mean alone.
//!
//! Inside a medium (`media`) light fades by Beer's law. Boundaries of media and rough thin walls cast shadows: what
//! shines through them is found by the paths that pass them. Smooth thin walls let shadow rays through, and a path that crosses
//! one goes on as if it had not met it: that is no bounce.

mod caustics;
mod media;
mod rims;
mod wavelength;

use std::ops::Add;

use glam::{Vec2, Vec3};

use self::caustics::{Competition, bsdf_share};
use self::media::{Media, beer};
use crate::{
    accel::Hit,
    bsdf::{Bsdf, BsdfSample, Kind},
    compile::Scene,
    geometry::{Frame, Ray, offset::offset_origin},
    light::{LightSample, Receiver, Source},
    material::{self, SurfacePoint},
    sampling::{mis::power_heuristic, sobol::PixelSampler},
    world::MaterialId,
};

/// Rays cast, by what they were for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RayCounts {
    /// From the camera: of paths, and those that only look at what is directly visible.
    pub camera: u64,
    /// From surfaces and lamps, to whatever they meet.
    pub bounce: u64,
    /// From surfaces to a light chosen on purpose, or to the camera.
    pub shadow: u64,
}

impl RayCounts {
    pub fn total(&self) -> u64 {
        self.camera + self.bounce + self.shadow
    }
}

impl Add for RayCounts {
    type Output = Self;

    fn add(self, more: Self) -> Self {
        Self {
            camera: self.camera + more.camera,
            bounce: self.bounce + more.bounce,
            shadow: self.shadow + more.shadow,
        }
    }
}

/// Shortens shadow rays, relative to their length: they must not meet the light they aim at.
const SHADOW_EPSILON: f32 = 1e-4;
/// Paths play Russian roulette from this vertex on.
const ROULETTE_FROM: u32 = 3;
/// Of the number that a path's wavelength is drawn with.
const DISPERSION_SALT: u64 = 0x6469_7370_6572_7365;
/// Culled or transparent surfaces a camera ray may pass before it gives up, and walls a path.
const MAX_PASSES: u32 = 256;

/// How the ray now traced was drawn: what it meets by chance weighs against what could have been chosen on purpose.
#[derive(Clone, Copy)]
struct Arrival {
    /// The surface point the ray left.
    from: Vec3,
    /// Solid-angle density; `None` for camera rays and delta lobes, whose finds weigh 1.
    pdf: Option<f32>,
}

pub use caustics::{Splat, trace_lamp_path};
pub use rims::Rims;

/// The radiance through pixel (x, y), by sample `index` of its sequence: along one camera ray, but for what is directly visible, for
/// which on the rims of lamps more rays look.
pub fn sample_pixel(
    scene: &Scene,
    rims: &Rims,
    [x, y]: [u32; 2],
    index: u32,
    counts: &mut RayCounts,
) -> Vec3 {
    let sampler = PixelSampler::woven(scene.seed, scene.weave, [x, y], index);
    let mut path = Path::from_camera(scene, [x, y], &sampler, counts);
    if let Some((share, radiance)) = rims.directly_visible(scene, [x, y], index, counts) {
        path = Path { share, radiance, ..path };
    }
    path.trace(scene, &sampler, counts)
}

/// A way that light may have come, from the camera as far as it has been followed.
#[derive(Clone)]
struct Path {
    /// Leaves the last vertex.
    ray: Ray,
    arrival: Arrival,
    /// Gathered so far.
    radiance: Vec3,
    throughput: Vec3,
    /// Of the light that the ray meets, the part that is counted: other rays may look for it as well.
    share: f32,
    /// Squared ratio of refractive indices along the path: what refraction did to the throughput is no reason to end it.
    eta_scale: f32,
    competition: Competition,
    bounces: BounceCounts,
    media: Media,
    /// In nm, once a surface has asked for it.
    wavelength: Option<f32>,
    /// Surfaces met.
    index: u32,
    /// Walls passed.
    passes: u32,
}

/// A surface on the path that scatters light.
struct Surface {
    point: SurfacePoint,
    id: MaterialId,
    bsdf: Bsdf,
    frame: Frame,
    wo: Vec3,
    local_wo: Vec3,
    /// The medium that it bounds, and its material.
    boundary: Option<(u32, Vec3)>,
    /// A wall without thickness.
    is_wall: bool,
}

/// What comes by way of a surface that the stem has arrived at: the mean of several paths from there on.
fn branched(
    scene: &Scene,
    stem: &Path,
    surface: &Surface,
    sampler: &PixelSampler,
    counts: &mut RayCounts,
) -> Vec3 {
    let mut sum = Vec3::ZERO;
    for branch in 0..scene.branches {
        let sampler = sampler.branch(branch, scene.branches);
        let mut path = Path { radiance: Vec3::ZERO, ..stem.clone() };
        let mut goes_on = path.scatter(scene, surface, &sampler, counts);
        while goes_on && let Some(surface) = path.arrive::<false>(scene, &sampler, counts) {
            goes_on = path.scatter(scene, &surface, &sampler, counts);
        }
        sum += path.radiance;
    }
    sum / scene.branches as f32
}

impl Surface {
    /// Whether several paths go on from it, if it is the first that does so: where it spreads light that comes from afar. What is behind a
    /// pixel is known by then, and another direction costs little, since most that leave the surface leave the scene. (Among
    /// lamps and walls the rest of a path costs more than its beginning, and the noise of edges within a pixel is not
    /// lessened.)
    fn branches(&self, scene: &Scene) -> bool {
        let spreads = !self.is_wall && !self.bsdf.is_delta();
        scene.branches > 1 && spreads && scene.lights.are_mostly_far(self.point.position)
    }
}

impl Path {
    #[inline(always)]
    fn from_camera(scene: &Scene, [x, y]: [u32; 2], sampler: &PixelSampler, counts: &mut RayCounts) -> Self {
        let [fx, fy, lx, ly] = sampler.draw4(0);
        let offset = scene.filter.sample(Vec2::new(fx, fy));
        let at = Vec2::new(x as f32 + 0.5, y as f32 + 0.5) + offset;
        counts.camera += 1;
        let ray = scene.camera.ray(at, Vec2::new(lx, ly));
        let competition = Competition::new(scene, ray.direction, offset);
        Self {
            ray,
            arrival: Arrival { from: ray.origin, pdf: None },
            radiance: Vec3::ZERO,
            throughput: Vec3::ONE,
            share: 1.0,
            eta_scale: 1.0,
            competition,
            bounces: BounceCounts::default(),
            media: Media::default(),
            wavelength: None,
            index: 0,
            passes: 0,
        }
    }

    /// The radiance along it, to its end.
    #[inline(always)]
    fn trace(mut self, scene: &Scene, sampler: &PixelSampler, counts: &mut RayCounts) -> Vec3 {
        while let Some(surface) = self.arrive::<false>(scene, sampler, counts) {
            if surface.branches(scene) {
                return self.radiance + branched(scene, &self, &surface, sampler, counts);
            }
            if !self.scatter(scene, &surface, sampler, counts) {
                break;
            }
        }
        self.radiance
    }

    /// Follows the ray to the next surface that scatters and adds the light that comes from there; `None` where the path ends. A
    /// `GLANCE` wants only what is directly visible, and always ends at the first surface.
    fn arrive<const GLANCE: bool>(
        &mut self,
        scene: &Scene,
        sampler: &PixelSampler,
        counts: &mut RayCounts,
    ) -> Option<Surface> {
        loop {
            let first = self.index == 0;
            let Some(hit) = meet(scene, &mut self.ray, sampler, self.index) else {
                let found = escaped(scene, &self.ray, &self.arrival, first);
                self.radiance += self.throughput * self.share * found;
                return None;
            };
            let id = scene.material_id(&hit);
            let material = &scene.materials[id.index()];
            let point = scene.surface_point(&self.ray, &hit);
            let wo = -self.ray.direction;
            let boundary = material::medium(material).map(|absorption| (id.0, absorption));
            match boundary {
                Some(medium) if wo.dot(point.ng) < 0.0 => {
                    self.throughput *= beer(self.media.behind(medium), hit.t);
                }
                _ if self.media.is_empty() => {}
                _ => self.throughput *= beer(self.media.absorption(), hit.t),
            }
            if let Some(color) = material::unlit(material, &scene.textures, &point) {
                self.radiance += self.throughput * self.share * color;
                return None;
            }
            let found = emitted(scene, &hit, &point, wo, &self.arrival, &self.competition);
            self.radiance += self.throughput * self.share * found;
            if GLANCE {
                return None;
            }
            if self.bounces.exhausted(scene) {
                // Light that needs no more scattering may still be behind walls.
                self.throughput *= material::passed_straight(material, &scene.textures, &point, wo);
                if self.throughput == Vec3::ZERO || !self.pass(&point, wo, counts) {
                    return None;
                }
                continue;
            }
            if self.wavelength.is_none() && material::disperses(material) {
                let (nm, weight) = wavelength::draw(sampler.hashed(DISPERSION_SALT));
                self.wavelength = Some(nm);
                self.throughput *= weight;
            }
            let (bsdf, frame) = material::scattering(material, &scene.textures, &point, wo, self.wavelength);
            let (local_wo, is_wall) = (frame.to_local(wo), material::is_wall(material));
            return Some(Surface { point, id, bsdf, frame, wo, local_wo, boundary, is_wall });
        }
    }

    /// Goes straight through a wall; false where it has passed too many.
    fn pass(&mut self, point: &SurfacePoint, wo: Vec3, counts: &mut RayCounts) -> bool {
        if self.passes == MAX_PASSES {
            return false;
        }
        self.passes += 1;
        self.competition.rule_out();
        self.set_out(point, -wo, counts);
        true
    }

    fn set_out(&mut self, point: &SurfacePoint, wi: Vec3, counts: &mut RayCounts) {
        self.ray = onward(point, wi);
        self.share = 1.0;
        self.index += 1;
        counts.bounce += 1;
    }

    /// Adds light chosen on purpose and goes on in a direction that the surface scatters from; false where the path ends.
    fn scatter(
        &mut self,
        scene: &Scene,
        surface: &Surface,
        sampler: &PixelSampler,
        counts: &mut RayCounts,
    ) -> bool {
        let Surface { point, bsdf, frame, wo, local_wo, boundary, is_wall, .. } = surface;
        let index = self.index;
        if !bsdf.is_delta() {
            let light = self.direct_light(scene, surface, sampler.draw4(2 + 2 * index), counts);
            self.radiance += self.throughput * light;
        }
        let [u_lobe, u, v, u_roulette] = sampler.draw4(1 + 2 * index);
        let Some(sample) = bsdf.sample(*local_wo, Vec2::new(u, v), u_lobe) else { return false };
        let wi = frame.to_world(sample.wi);
        if !same_side(point, *wo, wi, *local_wo, &sample) {
            return false;
        }
        self.throughput *= sample.weight;
        self.eta_scale *= sample.eta * sample.eta;
        if index >= ROULETTE_FROM {
            let survival = (self.throughput * self.eta_scale).max_element().clamp(0.05, 1.0);
            if u_roulette >= survival {
                return false;
            }
            self.throughput /= survival;
        }
        if self.throughput == Vec3::ZERO {
            return false;
        }
        // Straight through a wall: shadow rays pass there too, so that what is met beyond weighs as from before it.
        if sample.delta && sample.kind == Kind::Transmission && *is_wall {
            return self.pass(point, *wo, counts);
        }
        if index == 0 {
            self.competition.first(bsdf, point.position.distance(self.arrival.from), wo.dot(point.ng));
        } else {
            self.competition.next(scene, surface, wi, sample.pdf, sample.eta);
        }
        self.bounces.count(sample.kind);
        if let (Some((id, absorption)), Kind::Transmission) = (*boundary, sample.kind) {
            self.media.cross(id, absorption, wi.dot(point.ng) < 0.0);
        }
        self.arrival = Arrival { from: point.position, pdf: (!sample.delta).then_some(sample.pdf) };
        self.set_out(point, wi, counts);
        true
    }

    /// Light from one light chosen on purpose, scattered towards `wo`.
    fn direct_light(
        &self,
        scene: &Scene,
        surface: &Surface,
        [u_select, u, v, _]: [f32; 4],
        counts: &mut RayCounts,
    ) -> Vec3 {
        let Surface { point, local_wo, .. } = surface;
        let chosen = scene.lights.sample(point.position, &surface.receiver(scene), u_select, Vec2::new(u, v));
        let Some(light) = chosen else { return Vec3::ZERO };
        let local_wi = surface.frame.to_local(light.wi);
        let reflects = (local_wo.z > 0.0) == (local_wi.z > 0.0);
        if reflects != ((surface.wo.dot(point.ng) > 0.0) == (light.wi.dot(point.ng) > 0.0)) {
            return Vec3::ZERO;
        }
        let (f, bsdf_pdf) = surface.bsdf.eval_pdf(*local_wo, local_wi);
        if f == Vec3::ZERO {
            return Vec3::ZERO;
        }
        let radiance = light_radiance(scene, &light);
        if radiance == Vec3::ZERO {
            return Vec3::ZERO;
        }
        counts.shadow += 1;
        let (clear, through_walls) = transmittance(scene, &shadow_ray(point, &light));
        let weight = if light.delta { 1.0 } else { power_heuristic(light.mis_pdf, bsdf_pdf) };
        // no path from a lamp passes a wall
        let visible = if clear > 0.0 {
            clear * self.share_of_choice(scene, surface, &light, bsdf_pdf) + through_walls
        } else {
            through_walls
        };
        let direct = f * radiance * visible * (weight / light.pdf);
        if self.media.is_empty() && surface.boundary.is_none() {
            return direct;
        }
        direct * surface.faded(self.media, &light, reflects)
    }

    /// What paths from lamps leave to the choice of this light.
    fn share_of_choice(&self, scene: &Scene, surface: &Surface, light: &LightSample, bsdf_pdf: f32) -> f32 {
        let Source::Surface { object, primitive, point, normal, .. } = light.source else { return 1.0 };
        if self.index == 0 || !self.competition.is_open() || !surface.bsdf.is_glossy() {
            return 1.0;
        }
        let mut competition = self.competition;
        competition.next(scene, surface, light.wi, bsdf_pdf, 1.0);
        let Some(emitter) = scene.objects[object as usize].emitter(primitive) else { return 1.0 };
        let place = [point, normal, -light.wi];
        competition.weight(scene, emitter, place, bsdf_share(bsdf_pdf, light.mis_pdf))
    }
}

fn onward(point: &SurfacePoint, wi: Vec3) -> Ray {
    Ray::new(offset_origin(point.position, point.error, point.ng, wi), wi)
}

/// The first surface the ray does not pass through. Camera rays also pass the backs of single-sided surfaces.
fn meet(scene: &Scene, ray: &mut Ray, sampler: &PixelSampler, vertex: u32) -> Option<Hit> {
    let from_camera = vertex == 0;
    for _ in 0..MAX_PASSES {
        let hit = scene.accel.closest_where(ray, |hit| {
            let coverage = scene.coverage(ray, hit, from_camera);
            let salt = (vertex as u64) << 58 ^ (hit.object as u64) << 32 ^ hit.primitive as u64;
            coverage >= 1.0 || (coverage > 0.0 && sampler.hashed(salt) < coverage)
        })?;
        if !from_camera || scene.shows(ray, &hit) {
            return Some(hit);
        }
        let point = scene.surface_point(ray, &hit);
        if ray.direction.dot(point.ng) <= 0.0 {
            return Some(hit);
        }
        ray.origin = offset_origin(point.position, point.error, point.ng, ray.direction);
        ray.t_max -= hit.t;
    }
    None
}

/// What a ray without a hit sees: the environment and the disks of suns; the environment alone, where it is visible,
/// seen straight from the camera.
fn escaped(scene: &Scene, ray: &Ray, arrival: &Arrival, from_camera: bool) -> Vec3 {
    let environment = scene.lights.environment();
    if from_camera {
        return if environment.visible { environment.radiance(ray.direction) } else { Vec3::ZERO };
    }
    let (radiance, light_pdf) = scene.lights.escaped(arrival.from, ray.direction);
    match arrival.pdf {
        Some(pdf) => power_heuristic(pdf, light_pdf) * radiance,
        None => radiance,
    }
}

/// What the surface a ray met sends back along it.
#[inline(always)]
fn emitted(
    scene: &Scene,
    hit: &Hit,
    point: &SurfacePoint,
    wo: Vec3,
    arrival: &Arrival,
    competition: &Competition,
) -> Vec3 {
    let radiance = scene.emission(hit, &point.uvs, wo.dot(point.ng));
    if radiance == Vec3::ZERO {
        return Vec3::ZERO;
    }
    let Some(emitter) = scene.emitter(hit) else { return radiance };
    let place = [point.position, point.ng, wo];
    let weight = match arrival.pdf {
        Some(pdf) => {
            let light_pdf = scene.lights.mis_pdf_surface(emitter, arrival.from, point.position);
            power_heuristic(pdf, light_pdf)
                * competition.weight(scene, emitter, place, bsdf_share(pdf, light_pdf))
        }
        None => competition.weight(scene, emitter, place, 1.0),
    };
    weight * radiance
}

impl Surface {
    /// What the choice among lights may know of it.
    fn receiver(&self, scene: &Scene) -> Receiver {
        match scene.lights.heeds_receivers().then(|| self.bsdf.outline(self.local_wo)).flatten() {
            Some((albedos, alpha)) => Receiver::new(self.frame, self.local_wo, albedos, alpha),
            None => Receiver::anywhere(),
        }
    }

    /// The share that media leave of what comes from a light. Light from infinitely far away enters no medium but by its
    /// boundary, which casts a shadow: it is met where a mesh is not closed, and does not fade.
    fn faded(&self, mut media: Media, light: &LightSample, reflects: bool) -> Vec3 {
        if let (Some((id, absorption)), false) = (self.boundary, reflects) {
            media.cross(id, absorption, light.wi.dot(self.point.ng) < 0.0);
        }
        if light.distance.is_finite() { beer(media.absorption(), light.distance) } else { Vec3::ONE }
    }
}

fn light_radiance(scene: &Scene, light: &LightSample) -> Vec3 {
    match &light.source {
        Source::Radiance(radiance) => *radiance,
        Source::Surface { object, primitive, normal, uv, .. } => {
            let hit = Hit { t: light.distance, u: uv.x, v: uv.y, object: *object, primitive: *primitive };
            scene.emission_of_light(&hit, *normal, -light.wi.dot(*normal))
        }
    }
}

fn shadow_ray(point: &SurfacePoint, light: &LightSample) -> Ray {
    let origin = offset_origin(point.position, point.error, point.ng, light.wi);
    match &light.source {
        Source::Surface { point: target, .. } => {
            let direction = *target - origin;
            Ray { t_max: 1.0 - SHADOW_EPSILON, ..Ray::new(origin, direction) }
        }
        Source::Radiance(_) => Ray { t_max: light.distance, ..Ray::new(origin, light.wi) },
    }
}

/// The shares of light that reach the end of the ray without and with passing walls: 0 behind opaque surfaces, products of
/// what the others on the way let pass.
fn transmittance(scene: &Scene, ray: &Ray) -> (f32, Vec3) {
    let (mut clear, mut open) = (1.0, Vec3::ONE);
    let occluded = scene.accel.occluded_where(ray, |hit| {
        let (beside, straight) = scene.passed(ray, hit);
        clear *= beside;
        open *= beside + straight;
        open == Vec3::ZERO
    });
    if occluded { (0.0, Vec3::ZERO) } else { (clear, open - clear) }
}

/// Interpolated and mapped normals let a BSDF point through the surface; that light is lost, not leaked.
fn same_side(point: &SurfacePoint, wo: Vec3, wi: Vec3, local_wo: Vec3, sample: &BsdfSample) -> bool {
    let reflects = (local_wo.z > 0.0) == (sample.wi.z > 0.0);
    reflects == ((wo.dot(point.ng) > 0.0) == (wi.dot(point.ng) > 0.0))
}

/// Scattering events so far, in all and by kind.
#[derive(Clone, Default)]
struct BounceCounts {
    total: u32,
    diffuse: u32,
    glossy: u32,
    transmission: u32,
}

impl BounceCounts {
    fn count(&mut self, kind: Kind) {
        self.total += 1;
        match kind {
            Kind::Diffuse => self.diffuse += 1,
            Kind::Glossy => self.glossy += 1,
            Kind::Transmission => self.transmission += 1,
        }
    }

    fn exhausted(&self, scene: &Scene) -> bool {
        let limits = &scene.bounces;
        self.total > limits.total
            || self.diffuse > limits.diffuse
            || self.glossy > limits.glossy
            || self.transmission > limits.transmission
    }
}
