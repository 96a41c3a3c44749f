//! Facets that may lean further one way than the other, with any curve of reflectance: the specular part of
//! [`Layered`](super::Layered) materials.
//!
//! Multiple scattering is given back as in [`specular`](super::specular). The directional albedos that it needs, and that tell
//! what the layer leaves to its base, come from the tables where facets are alike in all directions and
//! the curve is one of theirs; else from a quadrature over visible normals on the spot, within 1 %.

use std::sync::LazyLock;

use glam::{Vec2, Vec3};

use super::albedo::Albedo;
use super::anisotropic::AnisotropicGgx;
use super::fresnel::{DielectricFresnel, LayerCurve, SCHLICK_AVERAGE, refract, schlick_weight};
use super::glass_albedo::glass_albedo;
use super::layer_albedo::Layer;
use super::reflect_about;
use super::table::{Lattice, Mirrored, cell, node};
use super::thin_film::ThinFilm;

/// Over the visible normals.
static LATTICE: LazyLock<Lattice<96>> = LazyLock::new(|| Lattice::new([POINTS, 55], 1.0));
const POINTS: u32 = 89;
/// A film's fringes are wider than this resolves up to 2 µm; averages do not show narrower ones.
const FILM_NODES: usize = 16;
/// As sharp as directions in f32 can be told apart.
const MIN_ALPHA: f32 = 1e-4;

/// How reflectance rises from normal incidence to grazing.
#[derive(Clone, Copy, Debug)]
enum Rise {
    Schlick,
    Dielectric(Layer),
}

/// Reflectance per channel by angle, seen from air.
#[derive(Clone, Copy, Debug)]
pub struct Reflectance {
    f0: Vec3,
    f90: Vec3,
    rise: Rise,
    pub film: Option<ThinFilm>,
    /// F_ms; zero where multiple scattering is left out.
    multiple: Vec3,
}

impl Reflectance {
    pub fn metal(color: Vec3, film: Option<ThinFilm>) -> Self {
        Self::new(color, Vec3::ONE, Rise::Schlick, film)
    }

    pub fn dielectric(curve: LayerCurve, film: Option<ThinFilm>) -> Self {
        let LayerCurve { f0, f90, rise } = curve;
        Self::new(f0, f90, Rise::Dielectric(Layer::new(rise)), film)
    }

    fn new(f0: Vec3, f90: Vec3, rise: Rise, film: Option<ThinFilm>) -> Self {
        Self { f0, f90, rise, film, multiple: Vec3::ZERO }
    }

    pub fn at(&self, cos: f32) -> Vec3 {
        self.filmed(self.bare(cos), cos)
    }

    /// What the film reflects at cos θ = (k / (n − 1))², for averages over many normals.
    fn film_nodes(&self) -> Option<[Vec3; FILM_NODES]> {
        let film = self.film.as_ref()?;
        Some(std::array::from_fn(|k| film.reflectance(node(k, FILM_NODES).powi(2))))
    }

    /// The average over normals of what they mirror: its albedo, but for further bounces.
    fn single<const N: usize>(&self, mirrored: &Mirrored<N>, white: f32) -> Vec3 {
        let weight = match &self.rise {
            Rise::Schlick => mirrored.average(schlick_weight),
            Rise::Dielectric(layer) => mirrored.average(|cos| layer.rise.at(cos)),
        };
        let bare = self.f0 * white + (self.f90 - self.f0) * weight;
        let (Some(film), Some(nodes)) = (&self.film, self.film_nodes()) else { return bare };
        let mut filmed = Vec3::ZERO;
        for (&kept, &cos) in mirrored.kept.iter().zip(&mirrored.cos) {
            let (k, t) = cell(cos.clamp(0.0, 1.0).sqrt(), FILM_NODES);
            filmed += kept * nodes[k].lerp(nodes[k + 1], t);
        }
        bare.lerp(filmed / POINTS as f32, film.weight)
    }

    fn bare(&self, cos: f32) -> Vec3 {
        let weight = match &self.rise {
            Rise::Schlick => schlick_weight(cos),
            Rise::Dielectric(layer) => layer.rise.at(cos),
        };
        self.f0 + (self.f90 - self.f0) * weight
    }

    fn filmed(&self, bare: Vec3, cos: f32) -> Vec3 {
        match &self.film {
            None => bare,
            Some(film) => bare.lerp(film.reflectance(cos), film.weight),
        }
    }

    /// At a boundary whose far side is `eta` times as dense, from either side: reflectance for light arriving at
    /// `cos`, and the cosine of the refracted ray, zero where reflection is total.
    pub fn at_boundary(&self, cos: f32, eta: f32) -> (Vec3, f32) {
        let (exact, cos_t) = DielectricFresnel::Exact.reflectance(cos, eta);
        if cos_t == 0.0 {
            return (Vec3::ONE, 0.0);
        }
        let r0 = ((eta - 1.0) / (eta + 1.0)).powi(2);
        let weight = ((exact - r0) / (1.0 - r0)).clamp(0.0, 1.0);
        let in_air = if eta < 1.0 { cos_t } else { cos };
        (self.filmed(self.f0 + (self.f90 - self.f0) * weight, in_air), cos_t)
    }

    fn is_exact(&self, eta: f32) -> bool {
        let r0 = Vec3::splat(((eta - 1.0) / (eta + 1.0)).powi(2));
        self.film.is_none() && self.f90 == Vec3::ONE && self.f0.abs_diff_eq(r0, 1e-4)
    }

    fn average(&self) -> Vec3 {
        let weight = match &self.rise {
            Rise::Schlick => SCHLICK_AVERAGE,
            Rise::Dielectric(layer) => layer.average(),
        };
        let bare = self.f0 + (self.f90 - self.f0) * weight;
        // light from all around arrives at 48° on average
        self.filmed(bare, 2.0 / 3.0)
    }
}

/// A distribution of facets.
#[derive(Clone, Copy, Debug)]
pub struct Facets {
    pub ggx: AnisotropicGgx,
    isotropic: bool,
    multiscatter: bool,
}

/// What a reflecting lobe weighs along one direction.
#[derive(Clone, Copy, Debug, Default)]
pub struct Weighed {
    /// Factor for multiple scattering.
    pub boost: Vec3,
    /// Directional albedo, the factor included.
    pub albedo: Vec3,
}

impl Facets {
    /// `alpha` along x and y.
    pub fn new(alpha: Vec2, multiscatter: bool) -> Self {
        let alpha = alpha.clamp(Vec2::splat(MIN_ALPHA), Vec2::ONE);
        Self { ggx: AnisotropicGgx { alpha }, isotropic: alpha.x == alpha.y, multiscatter }
    }

    /// The curve with what further bounces reflect.
    pub fn prepare(&self, mut reflectance: Reflectance) -> Reflectance {
        if self.multiscatter {
            let alpha = self.ggx.alpha;
            let e = Albedo::average((alpha.x * alpha.y).sqrt());
            let average = reflectance.average().min(Vec3::ONE);
            reflectance.multiple = average * e / (Vec3::ONE - average * (1.0 - e));
        }
        reflectance
    }

    /// E(wo), the albedo of facets that reflect everything, and what each of two curves weighs.
    pub fn weigh(&self, wo: Vec3, curves: [Option<&Reflectance>; 2]) -> (f32, [Weighed; 2]) {
        if self.isotropic && curves.iter().flatten().all(|c| c.film.is_none()) {
            let alpha = self.ggx.alpha.x;
            let albedo = Albedo::at(wo.z, alpha);
            let weighed = curves.map(|curve| {
                curve.map_or(Weighed::default(), |curve| {
                    let grazing = match &curve.rise {
                        Rise::Schlick => albedo.grazing,
                        Rise::Dielectric(layer) => albedo.white * layer.grazing_share(wo.z, alpha),
                    };
                    let single = curve.f0 * albedo.white + (curve.f90 - curve.f0) * grazing;
                    boosted(curve, albedo.white, single)
                })
            });
            return (albedo.white, weighed);
        }
        let mirrored = LATTICE.mirror(self.ggx.alpha, wo);
        let white = mirrored.white();
        let weighed = curves.map(|curve| {
            curve.map_or(Weighed::default(), |c| {
                boosted(c, white.clamp(0.01, 1.0), c.single(&mirrored, white))
            })
        });
        (white.clamp(0.01, 1.0), weighed)
    }

    /// The share of light along `wo` that one bounce at a boundary leaves, reflected and refracted together: that of the
    /// channel that keeps most, so that none gains.
    pub fn boundary_albedo(&self, wo: Vec3, eta: f32, reflectance: &Reflectance) -> f32 {
        if !self.multiscatter {
            return 1.0;
        }
        if self.isotropic && reflectance.is_exact(eta) {
            return glass_albedo(DielectricFresnel::Exact, wo.z, self.ggx.alpha.x, eta);
        }
        let mut kept = Vec3::ZERO;
        for h in LATTICE.normals(self.ggx.alpha, wo) {
            let wo_h = wo.dot(h);
            let (r, cos_t) = reflectance.at_boundary(wo_h, eta);
            let (reflected, refracted) = (reflect_about(wo, h), refract(wo, h, wo_h, cos_t, eta));
            if reflected.z > 0.0 {
                kept += r * self.ggx.g2_over_g1(wo, reflected);
            }
            if cos_t > 0.0 && refracted.z < 0.0 {
                kept += (1.0 - r) * self.ggx.g2_over_g1(wo, refracted);
            }
        }
        (kept.max_element() / POINTS as f32).clamp(0.01, 1.0)
    }
}

fn boosted(curve: &Reflectance, white: f32, single: Vec3) -> Weighed {
    let boost = Vec3::ONE + curve.multiple * ((1.0 - white) / white);
    Weighed { boost, albedo: boost * single }
}
