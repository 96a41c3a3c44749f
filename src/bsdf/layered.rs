//! glTF's material with all its layers: one lobe of each kind, weighed so that energy is kept.
//!
//! ```text
//! clearcoat                        weight_c
//! └ sheen                          × (1 − weight_c E_c)
//!   └ metallic: metal              × (1 − max(color_s) E_s) metallic
//!     dielectric                   × (1 − max(color_s) E_s) (1 − metallic)
//!     ├ thick, transmission: glass, reflecting and refracting
//!     └ facets
//!       └ × (1 − max E_d)
//!         ├ diffuse (1 − transmission) (1 − backlit), and backlit: through the surface
//!         └ thin wall: through the surface by the facets mirrored, × transmission
//! ```
//!
//! The structure is that of the extensions' normative parts (`fresnel_coat`, `fresnel_mix`, `mix`); as in
//! [`Pbr`](super::Pbr), what lies below a layer gets what the layer's directional albedo E(wo) leaves of light along wo,
//! where the specification's sample code has 1 − F. Hence no energy is gained, and none lost but by colour.
//!
//! - A wall without thickness does not refract: rough, it spreads light as its reflection does, mirrored to the
//!   far side (KHR_materials_transmission); the lobe is complete, so a white clear wall is white.
//! - A thick one refracts and reflects ([`glass`](super::glass)); its transmitted light is tinted once at each boundary.
//! - Diffuse transmission is Lambert's on the far side (KHR_materials_diffuse_transmission).
//! - Iridescence is a curve of reflectance ([`thin_film`](super::thin_film)), anisotropy a distribution of facets.
//!
//! `wo` is above the surface, always: who makes the lobe turns the frame and inverts `eta` inside a medium. A lobe is drawn by its
//! share of the albedo along wo; density and value are those of all lobes together, but for deltas (smooth glass and
//! smooth thin walls).

use glam::{Vec2, Vec3};

use super::coat::Coat;
use super::facets::{Facets, Reflectance, Weighed};
use super::glass::Glass;
use super::sheen::Sheen;
use super::{BsdfSample, Kind, reflect_about};
use crate::geometry::Frame;
use crate::sampling::warp::{cosine_hemisphere, cosine_hemisphere_pdf};

/// However faint a lobe is on average, where it is strong it must not weigh thousands.
const MIN_SHARE: f32 = 0.01;
/// A wall of narrower facets passes light straight.
const MIN_WALL_ALPHA: f32 = 1e-3;
const LOBES: usize = 7;

/// How light passes through.
#[derive(Clone, Copy, Debug)]
// There is one at a time, in a box with the rest.
#[allow(clippy::large_enum_variant)]
pub enum Passage {
    Opaque,
    /// A wall without thickness, of this share and colour.
    Wall {
        share: f32,
        tint: Vec3,
    },
    /// The boundary of a medium, for this share of the dielectric.
    Boundary {
        share: f32,
        glass: Glass,
    },
}

/// What is under sheen and clearcoat.
#[derive(Clone, Copy, Debug)]
pub struct Base {
    pub facets: Facets,
    /// Share of metal, 0 to 1.
    pub metallic: f32,
    pub metal: Reflectance,
    pub dielectric: Reflectance,
    /// Reflected by the dielectric's base, before its share of transmission is taken away.
    pub diffuse: Vec3,
    /// Passed diffusely to the far side, likewise.
    pub backlit: Vec3,
    pub passage: Passage,
    /// Normal of the diffuse base, in the frame of the facets.
    pub matte: Vec3,
}

#[derive(Clone, Copy, Debug)]
pub struct Layered {
    pub base: Base,
    pub sheen: Option<Sheen>,
    pub coat: Option<Coat>,
    /// Frames of the base and of the coat in that of the whole, where they have normals of their own.
    pub base_frame: Option<Frame>,
    pub coat_frame: Option<Frame>,
    /// The direction it was [prepared](Self::prepare) for, and what was found.
    pub seen: Option<(Vec3, Option<Seen>)>,
}

/// The order in which lobes are drawn.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Lobe {
    Coat,
    Sheen,
    Facets,
    Diffuse,
    Backlit,
    Wall,
    Glass,
}

const ORDER: [Lobe; LOBES] =
    [Lobe::Coat, Lobe::Sheen, Lobe::Facets, Lobe::Diffuse, Lobe::Backlit, Lobe::Wall, Lobe::Glass];

/// What each lobe weighs, seen along one `wo`.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// `wo` in the frames of base and coat.
    base_wo: Vec3,
    coat_wo: Vec3,
    coat: f32,
    sheen: f32,
    metal: Vec3,
    dielectric: Vec3,
    diffuse: Vec3,
    backlit: Vec3,
    /// What a thin wall passes in all.
    wall: Vec3,
    /// E of the facets.
    white: f32,
    glass: f32,
    /// Probability of drawing from each.
    p: [f32; LOBES],
}

impl Layered {
    /// BSDF × |cos θᵢ| and density of all lobes but deltas.
    pub fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Vec3, f32) {
        self.with_seen(wo, |seen| self.eval_pdf_seen(seen, wi)).unwrap_or((Vec3::ZERO, 0.0))
    }

    pub fn sample(&self, wo: Vec3, u: Vec2, u_lobe: f32) -> Option<BsdfSample> {
        self.with_seen(wo, |seen| self.sample_seen(seen, wo, u, u_lobe))?
    }

    /// See [`Bsdf::prepare`](super::Bsdf::prepare).
    pub fn prepare(&mut self, wo: Vec3) {
        self.seen = Some((wo, self.weigh(wo)));
    }

    fn with_seen<T>(&self, wo: Vec3, f: impl FnOnce(&Seen) -> T) -> Option<T> {
        match &self.seen {
            Some((from, seen)) if *from == wo => seen.as_ref().map(f),
            _ => self.weigh(wo).as_ref().map(f),
        }
    }

    fn sample_seen(&self, seen: &Seen, wo: Vec3, u: Vec2, u_lobe: f32) -> Option<BsdfSample> {
        let (lobe, p, u_side) = seen.choose(u_lobe)?;
        let (base, base_wo) = (&self.base, seen.base_wo);
        let (frame, wi, kind) = match lobe {
            Lobe::Coat => (&self.coat_frame, self.coat?.sample(seen.coat_wo, u), Kind::Glossy),
            Lobe::Sheen => (&self.base_frame, self.sheen?.sample(u), Kind::Diffuse),
            Lobe::Facets => {
                let h = base.facets.ggx.sample_normal(base_wo, u);
                (&self.base_frame, reflect_about(base_wo, h), Kind::Glossy)
            }
            Lobe::Diffuse => (&self.base_frame, self.lambert(u), Kind::Diffuse),
            Lobe::Backlit => (&self.base_frame, -self.lambert(u), Kind::Transmission),
            Lobe::Wall if self.is_smooth_wall() => {
                let (weight, wi) = (seen.wall / p, -wo);
                return Some(BsdfSample {
                    wi,
                    weight,
                    pdf: p,
                    eta: 1.0,
                    delta: true,
                    kind: Kind::Transmission,
                });
            }
            Lobe::Wall => {
                let wi = reflect_about(base_wo, base.facets.ggx.sample_normal(base_wo, u));
                (&self.base_frame, Vec3::new(wi.x, wi.y, -wi.z), Kind::Transmission)
            }
            Lobe::Glass => return self.sample_glass(seen, p, u, u_side),
        };
        // on its side of the lobe's own surface, and of the whole
        let on_side = |w: Vec3| if kind == Kind::Transmission { w.z < 0.0 } else { w.z > 0.0 };
        if !on_side(wi) {
            return None;
        }
        let wi = from(frame, wi);
        let (f, pdf) = self.eval_pdf_seen(seen, wi);
        (on_side(wi) && pdf > 0.0).then(|| BsdfSample {
            wi,
            weight: f / pdf,
            pdf,
            eta: 1.0,
            delta: false,
            kind,
        })
    }

    /// What a smooth thin wall passes straight: the weight of that lobe along `wo`, its delta aside.
    pub fn straight(&self, wo: Vec3) -> Vec3 {
        match self.base.passage {
            Passage::Wall { .. } if self.is_smooth_wall() => {
                self.with_seen(wo, |seen| seen.wall).unwrap_or(Vec3::ZERO)
            }
            _ => Vec3::ZERO,
        }
    }

    fn sample_glass(&self, seen: &Seen, p: f32, u: Vec2, u_side: f32) -> Option<BsdfSample> {
        let Passage::Boundary { glass, .. } = &self.base.passage else { return None };
        let sample = glass.sample(seen.base_wo, u, u_side)?;
        let wi = from(&self.base_frame, sample.wi);
        if (wi.z > 0.0) != (sample.kind == Kind::Glossy) {
            return None;
        }
        if sample.delta {
            let (weight, pdf) = (sample.weight * (seen.glass / p), sample.pdf * p);
            return Some(BsdfSample { wi, weight, pdf, ..sample });
        }
        let (f, pdf) = self.eval_pdf_seen(seen, wi);
        (pdf > 0.0).then(|| BsdfSample { wi, weight: f / pdf, pdf, ..sample })
    }

    fn eval_pdf_seen(&self, seen: &Seen, wi: Vec3) -> (Vec3, f32) {
        let (mut f, mut pdf) = (Vec3::ZERO, 0.0);
        let [p_coat, p_sheen, p_facets, p_diffuse, p_backlit, p_wall, p_glass] = seen.p;
        let (base, wo) = (&self.base, seen.base_wo);
        let base_wi = to(&self.base_frame, wi);
        if (base_wi.z > 0.0) != (wi.z > 0.0) {
            // a base that leans away: only the coat can be met on this side
        } else if wi.z > 0.0 {
            if let (Some(sheen), true) = (&self.sheen, p_sheen > 0.0) {
                f += seen.sheen * sheen.eval(wo, base_wi);
                pdf += p_sheen * sheen.pdf(base_wi);
            }
            if p_facets > 0.0
                && let Some(h) = (wo + base_wi).try_normalize()
            {
                let ggx = &base.facets.ggx;
                let wo_h = wo.dot(h);
                let mut reflectance = Vec3::ZERO;
                if seen.metal != Vec3::ZERO {
                    reflectance += seen.metal * base.metal.at(wo_h);
                }
                if seen.dielectric != Vec3::ZERO {
                    reflectance += seen.dielectric * base.dielectric.at(wo_h);
                }
                f += reflectance * (ggx.d(h) * ggx.g2_over_4_cos_cos(wo, base_wi) * base_wi.z);
                pdf += p_facets * ggx.pdf_mirrored(wo, h);
            }
            if p_diffuse > 0.0 {
                let lambert = cosine_hemisphere_pdf(base_wi.dot(base.matte));
                f += seen.diffuse * lambert;
                pdf += p_diffuse * lambert;
            }
        } else {
            if p_backlit > 0.0 {
                let lambert = cosine_hemisphere_pdf(-base_wi.dot(base.matte));
                f += seen.backlit * lambert;
                pdf += p_backlit * lambert;
            }
            if p_wall > 0.0 && !self.is_smooth_wall() {
                let mirrored = Vec3::new(base_wi.x, base_wi.y, -base_wi.z);
                if let Some(h) = (wo + mirrored).try_normalize() {
                    let ggx = &base.facets.ggx;
                    let lobe = ggx.d(h) * ggx.g2_over_4_cos_cos(wo, mirrored) * mirrored.z;
                    f += seen.wall * (lobe / seen.white);
                    pdf += p_wall * ggx.pdf_mirrored(wo, h);
                }
            }
        }
        if let (Passage::Boundary { glass, .. }, true) = (&base.passage, p_glass > 0.0)
            && (base_wi.z > 0.0) == (wi.z > 0.0)
        {
            let (value, density) = glass.eval_pdf(wo, base_wi);
            f += seen.glass * value;
            pdf += p_glass * density;
        }
        if let (Some(coat), true, true) = (&self.coat, p_coat > 0.0, wi.z > 0.0) {
            let (value, density) = coat.eval_pdf(seen.coat_wo, to(&self.coat_frame, wi));
            f += Vec3::splat(seen.coat * value);
            pdf += p_coat * density;
        }
        (f, pdf)
    }

    fn weigh(&self, wo: Vec3) -> Option<Seen> {
        let (base_wo, coat_wo) = (to(&self.base_frame, wo), to(&self.coat_frame, wo));
        if wo.z <= 0.0 || base_wo.z <= 0.0 {
            return None;
        }
        let (base, mut left) = (&self.base, 1.0);
        let mut share = [0.0; LOBES];
        let mut add = |lobe: Lobe, albedo: f32, least: f32| {
            share[lobe as usize] = if albedo > 0.0 { albedo.max(least) } else { 0.0 };
        };
        let mut coat = 0.0;
        if let Some(layer) = self.coat.as_ref().filter(|_| coat_wo.z > 0.0) {
            let (boost, albedo) = layer.weigh(coat_wo.z);
            coat = layer.weight * boost;
            add(Lobe::Coat, layer.weight * albedo, MIN_SHARE);
            left = (1.0 - layer.weight * albedo).max(0.0);
        }
        let sheen = left;
        if let Some(layer) = &self.sheen {
            let albedo = layer.color.element_sum() / 3.0 * layer.white_albedo(base_wo.z);
            add(Lobe::Sheen, left * albedo, MIN_SHARE);
            left *= layer.passed(base_wo.z);
        }
        let (boundary, wall) = match &base.passage {
            Passage::Opaque => (0.0, (0.0, Vec3::ZERO)),
            Passage::Wall { share, tint } => (0.0, (*share, *tint)),
            Passage::Boundary { share, .. } => (*share, (0.0, Vec3::ZERO)),
        };
        let metallic = left * base.metallic;
        let opaque = left * (1.0 - base.metallic) * (1.0 - boundary);
        let curves = [(metallic > 0.0).then_some(&base.metal), (opaque > 0.0).then_some(&base.dielectric)];
        let (white, [metal, dielectric]) = match curves {
            [None, None] => (1.0, [Weighed::default(); 2]),
            curves => base.facets.weigh(base_wo, curves),
        };
        let below = opaque * (1.0 - dielectric.albedo.max_element()).max(0.0);
        let [metal_albedo, dielectric_albedo] = [metallic * metal.albedo, opaque * dielectric.albedo];
        let diffuse = below * (1.0 - wall.0) * base.diffuse;
        let backlit = below * (1.0 - wall.0) * base.backlit;
        let wall = below * wall.0 * wall.1;
        let glass = left * (1.0 - base.metallic) * boundary;
        let mean = |v: Vec3| v.element_sum() / 3.0;
        add(Lobe::Facets, mean(metal_albedo + dielectric_albedo), MIN_SHARE);
        add(Lobe::Diffuse, mean(diffuse), 0.0);
        add(Lobe::Backlit, mean(backlit), 0.0);
        add(Lobe::Wall, mean(wall), 0.0);
        add(Lobe::Glass, glass, 0.0);
        let glass = match &base.passage {
            Passage::Boundary { glass: boundary, .. } if glass > 0.0 => glass * boundary.boost(base_wo),
            _ => 0.0,
        };
        let sum: f32 = share.iter().sum();
        (sum > 0.0).then(|| Seen {
            base_wo,
            coat_wo,
            coat,
            sheen,
            metal: metallic * metal.boost,
            dielectric: opaque * dielectric.boost,
            diffuse,
            backlit,
            wall,
            white,
            glass,
            p: share.map(|s| s / sum),
        })
    }

    fn is_smooth_wall(&self) -> bool {
        self.base.facets.ggx.alpha.max_element() < MIN_WALL_ALPHA
    }

    /// A direction by the cosine about the diffuse base's normal.
    fn lambert(&self, u: Vec2) -> Vec3 {
        match self.base.matte {
            Vec3::Z => cosine_hemisphere(u),
            leaning => Frame::from_z(leaning).to_world(cosine_hemisphere(u)),
        }
    }
}

impl Seen {
    /// A lobe, its probability, and what is left of the uniform number.
    fn choose(&self, u: f32) -> Option<(Lobe, f32, f32)> {
        let mut below = 0.0;
        let mut last = None;
        for (lobe, &p) in ORDER.iter().zip(&self.p) {
            if p > 0.0 {
                let rest = ((u - below) / p).clamp(0.0, 1.0 - f32::EPSILON / 2.0);
                last = Some((*lobe, p, rest));
                if u < below + p {
                    break;
                }
                below += p;
            }
        }
        last
    }
}

fn to(frame: &Option<Frame>, w: Vec3) -> Vec3 {
    frame.as_ref().map_or(w, |frame| frame.to_local(w))
}

fn from(frame: &Option<Frame>, w: Vec3) -> Vec3 {
    frame.as_ref().map_or(w, |frame| frame.to_world(w))
}
