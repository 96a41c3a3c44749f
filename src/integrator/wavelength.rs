//! A wavelength for paths that meet a dispersive surface.
//!
//! The three channels stand for bands of the spectrum, triangles about 460, 550 and 640 nm that overlap by half. Where a path
//! first meets a surface whose index depends on the wavelength, one is drawn: a band evenly, then from the band. The path
//! goes on with it, each channel weighed by its band over the density, so that the mean of every channel is unchanged
//! and what refracts alike for all stays white. Between two centres light is a mix of two channels: the rainbow is continuous.

use glam::Vec3;

/// Blue, green, red: in nm.
const CENTERS: [f32; 3] = [460.0, 550.0, 640.0];
const HALF_WIDTH: f32 = 90.0;

/// A wavelength in nm and what each of red, green and blue weighs at it; `u` is uniform in [0, 1).
pub fn draw(u: f32) -> (f32, Vec3) {
    let scaled = 3.0 * u;
    let band = (scaled as usize).min(2);
    let v = scaled - band as f32;
    // inverse of the triangle's distribution
    let t = if v < 0.5 { (2.0 * v).max(0.0).sqrt() - 1.0 } else { 1.0 - (2.0 * (1.0 - v)).max(0.0).sqrt() };
    let nm = CENTERS[band] + HALF_WIDTH * t;
    let [b, g, r] = CENTERS.map(|center| (1.0 - (nm - center).abs() / HALF_WIDTH).max(0.0));
    let sum = b + g + r;
    if sum <= 0.0 {
        return (nm, Vec3::ZERO); // the very edge of a band, where the density is zero too
    }
    (nm, Vec3::new(r, g, b) * (3.0 / sum))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_channel_keeps_its_mean() {
        let n = 30_000;
        let (mut mean, mut nm) = (Vec3::ZERO, Vec3::ZERO);
        for i in 0..n {
            let (wavelength, weight) = draw((i as f32 + 0.5) / n as f32);
            assert!(weight.is_finite() && (370.0..=730.0).contains(&wavelength));
            mean += weight / n as f32;
            nm += weight * wavelength / n as f32;
        }
        assert!(mean.abs_diff_eq(Vec3::ONE, 1e-3), "{mean}");
        assert!(nm.abs_diff_eq(Vec3::new(640.0, 550.0, 460.0), 1.0), "{nm}");
    }
}
