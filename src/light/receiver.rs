//! The surface that is to be lit, in outline: which lights it scatters towards the viewer, roughly.
//!
//! A sum of a cosine and a GGX lobe about the mirror direction, as densities over solid angle. Lights may be chosen by it without
//! anybody else knowing: the weights of multiple importance sampling go by the choice for any surface, and weights of two
//! strategies need only sum to one. It is zero only where the surface scatters nothing.

use std::f32::consts::{FRAC_1_PI, PI};

use glam::Vec3;

use super::cluster::WIDTH;
use crate::geometry::Frame;

/// The lobe is widened by this share of the angle under which a cluster is seen: half of it moves the half vector.
const WIDENING: f32 = 0.25;

#[derive(Clone, Copy, Debug)]
pub struct Receiver {
    frame: Frame,
    /// Towards the viewer, in the frame.
    wo: Vec3,
    /// Weights of cosine and lobe.
    diffuse: f32,
    glossy: f32,
    alpha_squared: f32,
    /// Scatters everywhere: all lights count alike.
    anywhere: bool,
}

impl Receiver {
    /// One of which nothing is known.
    pub fn anywhere() -> Self {
        let frame = Frame::from_z(Vec3::Z);
        Self { frame, wo: Vec3::Z, diffuse: 1.0, glossy: 0.0, alpha_squared: 1.0, anywhere: true }
    }

    /// One that scatters on the side of z alone: by the cosine, and by a lobe of width `alpha`, with these albedos.
    pub fn new(frame: Frame, wo: Vec3, [diffuse, glossy]: [f32; 2], alpha: f32) -> Self {
        let alpha_squared = alpha * alpha;
        let s = (wo.z * wo.z + alpha_squared * (wo.x * wo.x + wo.y * wo.y)).sqrt();
        let glossy = 0.5 * glossy / (wo.z.abs() + s);
        Self { frame, wo, diffuse: diffuse * FRAC_1_PI, glossy, alpha_squared, anywhere: false }
    }

    /// For balls about centers at −`from` (by axis) and with these squared radii and distances: what of their light is
    /// scattered towards the viewer, roughly, times `importance`.
    #[inline]
    pub fn weigh(
        &self,
        importance: &[f32; WIDTH],
        from: &[[f32; WIDTH]; 3],
        radius_squared: &[f32; WIDTH],
        distance_squared: &[f32; WIDTH],
    ) -> [f32; WIDTH] {
        if self.anywhere {
            return *importance;
        }
        let Frame { x, y, z } = self.frame;
        let mut weights = [0.0; WIDTH];
        for i in 0..WIDTH {
            let scale = -1.0 / distance_squared[i].sqrt();
            let local =
                |axis: Vec3| (from[0][i] * axis.x + from[1][i] * axis.y + from[2][i] * axis.z) * scale;
            let cos = local(z);
            let ball = radius_squared[i] / distance_squared[i];
            let ball = if ball < 1.0 { ball } else { 1.0 };
            let reach = cos + ball.sqrt();
            let reach = if reach < 1.0 { reach } else { 1.0 };
            let mut scattered = self.diffuse * reach;
            if self.glossy > 0.0 {
                let a2 = self.alpha_squared + WIDENING * ball;
                let (hx, hy, hz) = (local(x) + self.wo.x, local(y) + self.wo.y, cos + self.wo.z);
                let across = hx * hx + hy * hy;
                let t = (across + a2 * hz * hz) / (across + hz * hz);
                scattered += self.glossy * a2 / (PI * t * t);
            }
            let visible = if reach > 0.0 { scattered } else { 0.0 };
            // (neither holds of NaN, at the center)
            let seen_whole = (distance_squared[i] > radius_squared[i]) & (visible >= 0.0);
            weights[i] = importance[i] * if seen_whole { visible } else { self.diffuse + self.glossy };
        }
        weights
    }
}
