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

use glam::Vec2;

use super::fresnel::schlick_weight;
use super::table::{cell, mirrored, node};

const ROUGHNESSES: usize = 32;
const COSINES: usize = 32;
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
            let r = node(i, ROUGHNESSES).max(TINY.sqrt());
            std::array::from_fn(|j| {
                let t = node(j, COSINES);
                let root_mu = t * r / (1.0 + r - t);
                let mu = (root_mu * root_mu).clamp(TINY, 1.0);
                let Vec2 { x: white, y: grazing } = integrate(mu, r * r);
                Vec2::new(white, grazing / white - schlick_weight(mu))
            })
        });
        let mut table = Self { rows: rows.collect(), average: Vec::new() };
        let cosines = (0..64).map(|k| (k as f32 + 0.5) / 64.0);
        table.average = (0..ROUGHNESSES)
            .map(|i| {
                let alpha = node(i, ROUGHNESSES).powi(2);
                cosines.clone().map(|mu| 2.0 * mu * table.at(mu, alpha).white / 64.0).sum()
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

/// (E, B), as averages of G₂/G₁ over the visible normals.
fn integrate(mu: f32, alpha: f32) -> Vec2 {
    let mirrored = mirrored(alpha, mu);
    Vec2::new(mirrored.white(), mirrored.average(schlick_weight))
}
