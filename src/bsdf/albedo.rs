//! Directional albedo of GGX reflection: how much of the light from one direction leaves after one bounce.
//!
//! With facets that reflect by Schlick's curve between f₀ and f₉₀ the albedo is f₀ E + (f₉₀ − f₀) B, where
//!
//! ```text
//! E(μ, α) = ∫ D G₂ / (4 μ) dωᵢ                     facets that reflect everything
//! B(μ, α) = ∫ D G₂ / (4 μ) (1 − wo·h)⁵ dωᵢ         facets that reflect at grazing angles only
//! E_avg(α) = 2 ∫ E(μ, α) μ dμ
//! ```
//!
//! and μ = wo_z. Both are tabulated at first use by quadrature over the visible normals, whose density leaves the
//! bounded integrand G₂/G₁. E dips to 0.89 where μ ≈ α and rises to 1 at the horizon, at any α: the coordinates
//! (√μ (1 + r) / (√μ + r), r), r = √α, follow the dip, so that 32 × 32 nodes are within 0.2 % down to μ = 0.002.
//! For a mirror B is (1 − μ)⁵, which the first coordinate cannot resolve: the table holds B/E less that.

use std::sync::LazyLock;

use glam::{Vec2, Vec3};

use super::fresnel::schlick_weight;
use super::ggx::Ggx;
use super::quadrature::{cell, gauss_legendre};
use super::reflect_about;

const ROUGHNESSES: usize = 32;
const COSINES: usize = 32;
/// Quadrature nodes in the polar and in the azimuthal direction of the cap of normals.
const POLAR: usize = 12;
const AZIMUTHAL: usize = 24;
/// The nodes at zero stand for the limit.
const TINY: f32 = 1e-5;

#[derive(Clone, Copy, Debug)]
pub struct Albedo {
    /// E
    pub white: f32,
    /// B
    pub grazing: f32,
}

struct Table {
    /// (E, B/E − (1 − μ)⁵) by roughness, then by cosine.
    rows: Vec<[Vec2; COSINES]>,
    average: Vec<f32>,
}

static TABLE: LazyLock<Table> = LazyLock::new(Table::new);

impl Albedo {
    /// `mu` in (0, 1], `alpha` in [0, 1].
    pub fn at(mu: f32, alpha: f32) -> Self {
        TABLE.at(mu, alpha)
    }

    /// E_avg
    pub fn average(alpha: f32) -> f32 {
        let (i, t) = cell(alpha.sqrt(), ROUGHNESSES);
        let average = &TABLE.average;
        average[i] + t * (average[i + 1] - average[i])
    }
}

impl Table {
    fn new() -> Self {
        let rows = (0..ROUGHNESSES).map(|i| {
            let r = (i as f32 / (ROUGHNESSES - 1) as f32).max(TINY.sqrt());
            std::array::from_fn(|j| {
                let t = j as f32 / (COSINES - 1) as f32;
                let root_mu = t * r / (1.0 + r - t);
                let mu = (root_mu * root_mu).clamp(TINY, 1.0);
                let albedo = integrate(mu, r * r);
                Vec2::new(albedo.white, albedo.grazing / albedo.white - schlick_weight(mu))
            })
        });
        let mut table = Self { rows: rows.collect(), average: Vec::new() };
        let nodes = gauss_legendre::<32>();
        table.average = (0..ROUGHNESSES)
            .map(|i| {
                let alpha = (i as f32 / (ROUGHNESSES - 1) as f32).powi(2);
                nodes.iter().map(|&(mu, weight)| 2.0 * weight * mu * table.at(mu, alpha).white).sum()
            })
            .collect();
        table
    }

    fn at(&self, mu: f32, alpha: f32) -> Albedo {
        let (r, root_mu) = (alpha.sqrt(), mu.sqrt());
        let (i, s) = cell(r, ROUGHNESSES);
        let (j, t) = cell(root_mu * (1.0 + r) / (root_mu + r), COSINES);
        let row = |i: usize| self.rows[i][j].lerp(self.rows[i][j + 1], t);
        let Vec2 { x: white, y: residue } = row(i).lerp(row(i + 1), s);
        Albedo { white, grazing: white * (residue + schlick_weight(mu)).max(0.0) }
    }
}

/// By quadrature over the visible normals: E and B as averages of G₂/G₁.
fn integrate(mu: f32, alpha: f32) -> Albedo {
    let ggx = Ggx { alpha };
    let wo = Vec3::new((1.0 - mu * mu).sqrt(), 0.0, mu);
    let nodes = gauss_legendre::<POLAR>();
    let mut sum = Vec2::ZERO;
    for k in 0..AZIMUTHAL {
        let u_azimuth = 0.5 * (k as f32 + 0.5) / AZIMUTHAL as f32; // the other half is its mirror image
        let at = |u| {
            let h = ggx.sample_normal(wo, Vec2::new(u, u_azimuth));
            (h, reflect_about(wo, h))
        };
        // Beyond `end` mirrored directions are below the surface; there the integrand stops short, so the rule
        // ends there and crowds its nodes towards it.
        let (mut end, mut below) = (1.0 - f32::EPSILON, 1.0);
        if at(end).1.z <= 0.0 {
            end = 0.0;
            for _ in 0..12 {
                let middle = 0.5 * (end + below);
                *(if at(middle).1.z > 0.0 { &mut end } else { &mut below }) = middle;
            }
        }
        for (x, weight) in nodes {
            let (h, wi) = at(end * (1.0 - x * x));
            if wi.z > 0.0 {
                let share = 2.0 * x * end * weight * ggx.g2_over_g1(wo, wi);
                sum += share * Vec2::new(1.0, schlick_weight(wo.dot(h)));
            }
        }
    }
    sum /= AZIMUTHAL as f32;
    Albedo { white: sum.x, grazing: sum.y }
}
