//! Caustics from the lamp's side: paths that start at an emissive surface, are focused by mirrors, smooth glass and metal, and
//! are seen on the matte surface where they arrive, or where that scatters them next.
//!
//! A path from the camera finds such light only where a diffuse bounce happens to go into the glass just so that it ends
//! at the lamp. Both ways are weighed against each other (Veach 1997, chapter 10). Of all paths only those compete
//! whose vertices are matte, mirror-like or glossy, the first from the camera matte, the last before the lamp not; no other
//! starts at the lamp. With `x₀ x₁ … x_k` from the lens to the lamp, densities over area, and matte vertices
//! taken to scatter by the cosine both ways, everything between cancels but refractive indices and what is not alike both ways at
//! glossy vertices, and the ratio of the two densities is
//!
//! ```text
//! r = N π p(x_k, ω) d₀² / (q cos θ₁ cos θ_k) × ∏ η⁻² ∏ s        weight of the path from the camera: 1 / (1 + r²)
//! ```
//!
//! p being the density of [`Aim`](crate::light::Aim), q that of picture points and directions at the camera, d₀ and θ₁ of the first
//! edge, θ_k of the last at the lamp, η the refractive index towards the lamp over that towards the camera of each refraction,
//! s the density over projected solid angle of a glossy vertex towards the camera over that towards the lamp (1 for GGX but for masking),
//! and N the number of paths from lamps for each path through the pixel. A glossy vertex may also choose the lamp, as the last before it: then
//! r counts p_b / √(p_b² + p_n²) times, with its densities of finding the lamp by its BSDF (p_b) and by choice (p_n), and both of
//! these have the weight 1 / (1 + r²) beside that which weighs them against each other. The cosines of matte vertices are an
//! approximation of what they do, but the same one on both sides: the weights of a path add up to 1, whatever r.

use std::f32::consts::PI;

use glam::{Vec2, Vec3};

use super::{RayCounts, SHADOW_EPSILON, Surface, meet, onward, same_side};
use crate::{
    accel::Hit,
    bsdf::Bsdf,
    camera::Connection,
    compile::Scene,
    geometry::{Frame, Ray, offset::offset_origin},
    light::Departure,
    material::{self, SurfacePoint},
    sampling::{mis::power_heuristic, sobol::PixelSampler},
    world::MaterialId,
};

/// Light that a path from a lamp brings to a pixel of the whole picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Splat {
    pub x: u32,
    pub y: u32,
    pub radiance: Vec3,
}

/// A path from a lamp ends after this many scattering events.
const LONGEST: u32 = 16;
/// Paths from lamps draw from other patterns than paths from the camera through the same pixel.
const SALT: u64 = 0x6c61_6d70_7061_7468;
/// Less is left to Russian roulette.
const LEAST_SURVIVAL: f32 = 0.05;

/// Whether a path that the camera started could have come from a lamp, and r but for what the lamp's end adds.
#[derive(Clone, Copy)]
pub struct Competition {
    /// d₀² / cos θ₁ × ∏ η⁻²; `None` once some vertex rules it out.
    ratio: Option<f32>,
    /// At the camera: what q is found by.
    direction: Vec3,
    offset: Vec2,
    /// Scattering events so far.
    events: u32,
    /// Whether the last of them focuses, so that a lamp may be next.
    focused: bool,
}

impl Competition {
    /// At the camera. `offset` is that of the picture point from the middle of the pixel.
    pub fn new(scene: &Scene, direction: Vec3, offset: Vec2) -> Self {
        Self { ratio: scene.aim.as_ref().map(|_| 1.0), direction, offset, events: 0, focused: false }
    }

    /// The first surface, seen along `wo` from this distance.
    pub fn first(&mut self, bsdf: &Bsdf, distance: f32, cos: f32) {
        self.events = 1;
        self.ratio = self.ratio.filter(|_| bsdf.is_matte()).map(|_| distance * distance / cos.abs());
    }

    /// A surface further on, which the path leaves along `wi`, by `eta`. `pdf` is the density with which its BSDF does that.
    pub fn next(&mut self, scene: &Scene, surface: &Surface, wi: Vec3, pdf: f32, eta: f32) {
        self.events += 1;
        let Some(ratio) = self.ratio else { return };
        let Surface { point, id, bsdf, frame, wo, local_wo, .. } = surface;
        self.focused = !bsdf.is_matte();
        if self.events > LONGEST {
            self.rule_out(); // no path from a lamp is as long
        } else if bsdf.is_glossy() {
            let material = &scene.materials[id.index()];
            let both_ways = material::scatters_both_ways(material, &scene.textures, point, [*wo, wi]);
            let (_, back) = bsdf.eval_pdf(frame.to_local(wi), *local_wo);
            let of_pdfs = symmetry([back, pdf], [*wo, wi], point.ng);
            self.ratio = (both_ways && back > 0.0).then_some(ratio * of_pdfs);
        } else if self.focused {
            self.ratio = bsdf.is_delta().then_some(ratio / (eta * eta));
        }
    }

    /// Whether a path from a lamp may have come this way so far.
    pub fn is_open(&self) -> bool {
        self.ratio.is_some()
    }

    pub fn rule_out(&mut self) {
        self.ratio = None;
    }

    /// The share of the path from the camera that goes on to a lamp: its point, geometric normal, and the direction back. `bsdf_share`
    /// is that of the last surface, 1 for a mirror.
    pub fn weight(&self, scene: &Scene, emitter: u32, [point, ng, wo]: [Vec3; 3], bsdf_share: f32) -> f32 {
        let (Some(ratio), Some(aim), true) = (self.ratio, &scene.aim, self.focused) else { return 1.0 };
        let pdf = aim.pdf(emitter, point, ng, wo);
        if pdf <= 0.0 {
            return 1.0;
        }
        let q = scene.camera.density(self.direction) * scene.filter.density(self.offset);
        power_heuristic(1.0, scene.lamp_paths * PI * ratio * pdf * bsdf_share / (q * wo.dot(ng).abs()))
    }
}

/// Density over projected solid angle of going from the lamp's side to the camera's, over that of the other way, by densities
/// over solid angle of both ways, and the directions they end in.
fn symmetry([back, ahead]: [f32; 2], [to_camera, to_lamp]: [Vec3; 2], ng: Vec3) -> f32 {
    back / ahead * (to_lamp.dot(ng) / to_camera.dot(ng)).abs()
}

/// Of the densities with which the last surface before a lamp finds it by its BSDF and by choosing it, the part that the former has
/// in the root of the sum of their squares.
pub fn bsdf_share(bsdf_pdf: f32, light_pdf: f32) -> f32 {
    if bsdf_pdf > 0.0 { 1.0 / (light_pdf / bsdf_pdf).hypot(1.0) } else { 0.0 }
}

/// Traces one path from a lamp, number `index` of those that belong to pixel (x, y), and adds what it brings to any
/// pixels.
pub fn trace_lamp_path(
    scene: &Scene,
    [x, y]: [u32; 2],
    index: u32,
    counts: &mut RayCounts,
    splats: &mut Vec<Splat>,
) {
    let Some(aim) = &scene.aim else { return };
    let sampler = PixelSampler::new(scene.seed ^ SALT, x, y, index);
    let [u_lamp, u_ball, a, b] = sampler.draw4(0);
    let [c, d, ..] = sampler.draw4(1);
    let Some(lamp) = aim.sample([u_lamp, u_ball], Vec2::new(a, b), Vec2::new(c, d)) else { return };
    let cos = lamp.direction.dot(lamp.normal);
    let mut flux = scene.emission_of_light(&place(&lamp), lamp.normal, cos) * (cos.abs() / lamp.pdf);
    // r but for what the camera's end adds
    let mut ratio = scene.lamp_paths * PI * lamp.pdf / cos.abs();
    let mut ray = departing(scene, &lamp);
    for event in 0..LONGEST {
        if flux == Vec3::ZERO || event > scene.bounces.total {
            return;
        }
        counts.bounce += 1;
        let Some(hit) = meet(scene, &mut ray, &sampler, event + 1) else { return };
        let id = scene.material_id(&hit);
        let material = &scene.materials[id.index()];
        if !material::may_carry_caustics(material) {
            return;
        }
        let point = scene.surface_point(&ray, &hit);
        let wo = -ray.direction; // towards the lamp
        let (bsdf, frame) = material::scattering(material, &scene.textures, &point, wo, None);
        let local_wo = frame.to_local(wo);
        let [u_lobe, u, v, u_roulette] = sampler.draw4(2 + 2 * event);
        let wi = if bsdf.is_delta() {
            let Some(sample) = bsdf.sample(local_wo, Vec2::new(u, v), u_lobe) else { return };
            let wi = frame.to_world(sample.wi);
            if !same_side(&point, wo, wi, local_wo, &sample) {
                return;
            }
            // radiance is scaled where it is refracted, flux is not
            let scale = sample.eta * sample.eta;
            flux *= sample.weight * scale;
            ratio *= scale;
            wi
        } else {
            let is_matte = bsdf.is_matte();
            if !is_matte && !bsdf.is_glossy() || is_matte && event == 0 {
                return;
            }
            let arrival = Arrival { point: &point, id, towards_lamp: wo, flux, ratio };
            if is_matte {
                let [l0, l1, ..] = sampler.draw4(3 + 2 * event);
                arrival.show(scene, Vec2::new(l0, l1), &sampler, counts, splats);
            }
            let Some(sample) = bsdf.sample(local_wo, Vec2::new(u, v), u_lobe) else { return };
            let wi = frame.to_world(sample.wi);
            let Some(scattered) = arrival.scattered(scene, wi) else { return };
            if !is_matte {
                if !material::scatters_both_ways(material, &scene.textures, &point, [wi, wo]) {
                    return;
                }
                ratio *= symmetry([sample.pdf, scattered.pdf], [wi, wo], point.ng);
                if event == 0 {
                    let light_pdf = scene.lights.mis_pdf_surface(lamp.emitter, point.position, lamp.point);
                    ratio *= bsdf_share(scattered.pdf, light_pdf);
                }
            }
            let weight = scattered.share / sample.pdf;
            let survival = weight.max_element().clamp(LEAST_SURVIVAL, 1.0);
            if u_roulette >= survival {
                return;
            }
            flux *= weight / survival;
            wi
        };
        ray = onward(&point, wi);
    }
}

/// The point of the lamp as a ray that starts there would have hit it.
fn place(lamp: &Departure) -> Hit {
    Hit { t: 0.0, u: lamp.uv.x, v: lamp.uv.y, object: lamp.object, primitive: lamp.primitive }
}

fn departing(scene: &Scene, lamp: &Departure) -> Ray {
    let point = scene.surface_point(&Ray::new(lamp.point, lamp.direction), &place(lamp));
    onward(&point, lamp.direction)
}

/// Of light from the lamp.
struct Scattered {
    /// BSDF × |cos|, sr⁻¹.
    share: Vec3,
    /// The solid-angle density with which a path from the camera would have gone on towards the lamp.
    pdf: f32,
}

/// Flux at a matte or glossy surface.
struct Arrival<'a> {
    point: &'a SurfacePoint,
    id: MaterialId,
    towards_lamp: Vec3,
    /// As it arrives, W per channel.
    flux: Vec3,
    ratio: f32,
}

impl Arrival<'_> {
    /// BSDF × |cos| at `wi` for light that arrives from the lamp, by the interpolated normal where the path from the camera
    /// would count it and by the geometric one where flux is concerned (Veach 1997, section 5.3). `None` where there is none.
    fn scattered(&self, scene: &Scene, wi: Vec3) -> Option<Scattered> {
        let Self { point, id, towards_lamp, .. } = *self;
        let material = &scene.materials[id.index()];
        let (bsdf, frame): (Bsdf, Frame) = material::scattering(material, &scene.textures, point, wi, None);
        let (seen_from, lit_from) = (frame.to_local(wi), frame.to_local(towards_lamp));
        let (out, into) = (wi.dot(point.ng), towards_lamp.dot(point.ng));
        let reflects = (seen_from.z > 0.0) == (lit_from.z > 0.0);
        if reflects != ((out > 0.0) == (into > 0.0)) || into == 0.0 {
            return None;
        }
        let (f, pdf) = bsdf.eval_pdf(seen_from, lit_from);
        (f != Vec3::ZERO).then(|| Scattered { share: f * (out / into).abs(), pdf })
    }

    /// What the camera sees of it, in every pixel whose filter reaches there.
    fn show(
        &self,
        scene: &Scene,
        lens: Vec2,
        sampler: &PixelSampler,
        counts: &mut RayCounts,
        splats: &mut Vec<Splat>,
    ) {
        let Some(seen) = scene.camera.connect(self.point.position, lens) else { return };
        let reach = scene.filter.reach();
        let [left, top, width, height] = scene.window.map(|n| n as f32);
        let (low, high) = (seen.at - reach, seen.at + reach);
        if high.x < left || high.y < top || low.x > left + width || low.y > top + height {
            return;
        }
        let to_lens = seen.lens - self.point.position;
        let distance = to_lens.length();
        let wi = to_lens / distance;
        let cos = wi.dot(self.point.ng);
        let material = &scene.materials[self.id.index()];
        if cos <= 0.0 && !material.double_sided {
            return; // the camera passes backs of single-sided surfaces
        }
        let Some(scattered) = self.scattered(scene, wi) else { return };
        counts.shadow += 1;
        if !self.is_visible(scene, &seen, sampler) {
            return;
        }
        let brought = self.flux * scattered.share / cos.abs();
        // area density of the camera's paths here, but for the pixel's filter
        let density = seen.density * cos.abs() / (distance * distance);
        for y in pixels(low.y, high.y, top, height) {
            for x in pixels(low.x, high.x, left, width) {
                let filter = scene.filter.density(seen.at - Vec2::new(x as f32 + 0.5, y as f32 + 0.5));
                if filter > 0.0 {
                    let density = density * filter;
                    let weight = power_heuristic(self.ratio / density, 1.0);
                    splats.push(Splat { x, y, radiance: brought * (weight * density) });
                }
            }
        }
    }

    /// Whether a ray from the lens gets here.
    fn is_visible(&self, scene: &Scene, seen: &Connection, sampler: &PixelSampler) -> bool {
        let target = offset_origin(
            self.point.position,
            self.point.error,
            self.point.ng,
            seen.lens - self.point.position,
        );
        let mut ray = Ray { t_max: 1.0 - SHADOW_EPSILON, ..Ray::new(seen.lens, target - seen.lens) };
        meet(scene, &mut ray, sampler, 0).is_none()
    }
}

/// Of the window's pixels along one axis, those whose middle may lie between `low` and `high`.
fn pixels(low: f32, high: f32, start: f32, length: f32) -> std::ops::Range<u32> {
    let first = (low - 0.5).floor().max(start);
    let last = (high + 0.5).ceil().min(start + length);
    first as u32..(last as u32).max(first as u32)
}
