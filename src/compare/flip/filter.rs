//! The filters of FLIP as 1D kernels, and convolution along rows and columns; beyond the edge the last pixel goes on.
//!
//! *Spatial* filters (2020, section 4.1.2) model the contrast sensitivity of the eye for each opponent axis. They are
//! sums of Gaussians, in degrees of visual angle d:
//!
//! ```text
//! g(d) = Σᵢ aᵢ √(π / bᵢ) exp(−π² d² / bᵢ)
//! ```
//!
//! A single Gaussian in 2D is the product of two in 1D. The sum of two (axis Cz) is kept as two kernels whose 2D products
//! are added; each 1D kernel then carries the square root of its weight.
//!
//! *Feature* filters (section 4.2) are a Gaussian of σ = 0.082 / 2 degrees and its first two derivatives, whose
//! positive and negative weights sum to 1 and −1.

use std::f32::consts::PI;

/// Odd in number, the middle one belongs to the pixel itself.
pub type Kernel = Vec<f32>;

/// Width of the edge detector, degrees.
const FEATURE_WIDTH: f32 = 0.082;

/// a and b of the axes Yy, Cx, and of the two parts of Cz (table 1).
const SENSITIVITY: [[f32; 2]; 4] = [[1.0, 0.0047], [1.0, 0.0053], [34.1, 0.04], [13.5, 0.025]];

#[derive(Debug)]
pub struct Spatial {
    pub yy: Kernel,
    pub cx: Kernel,
    pub cz: [Kernel; 2],
}

#[derive(Debug)]
pub struct Feature {
    pub smooth: Kernel,
    pub edge: Kernel,
    pub point: Kernel,
}

impl Spatial {
    pub fn new(pixels_per_degree: f32) -> Self {
        let widest = SENSITIVITY.iter().fold(0.0, |widest: f32, &[_, b]| widest.max(b));
        let radius = (3.0 * (widest / (2.0 * PI * PI)).sqrt() * pixels_per_degree).ceil() as i32;
        let kernels = SENSITIVITY.map(|[a, b]| -> Kernel {
            let weight = (a * (PI / b).sqrt()).sqrt();
            let at = |x: i32| x as f32 / pixels_per_degree;
            (-radius..=radius).map(|x| weight * (-PI * PI * at(x) * at(x) / b).exp()).collect()
        });
        let [yy, cx, cz1, cz2] = kernels;
        let sum = |kernel: &Kernel| kernel.iter().sum::<f32>();
        // In 2D both parts of Cz together sum to 1.
        let cz_sum = (sum(&cz1).powi(2) + sum(&cz2).powi(2)).sqrt();
        Self {
            cx: scaled(&cx, sum(&cx)),
            cz: [scaled(&cz1, cz_sum), scaled(&cz2, cz_sum)],
            yy: scaled(&yy, sum(&yy)),
        }
    }
}

impl Feature {
    pub fn new(pixels_per_degree: f32) -> Self {
        let sigma = 0.5 * FEATURE_WIDTH * pixels_per_degree;
        let radius = (3.0 * sigma).ceil() as i32;
        let kernel = |f: &dyn Fn(f32) -> f32| -> Kernel {
            (-radius..=radius)
                .map(|x| x as f32)
                .map(|x| f(x) * (-x * x / (2.0 * sigma * sigma)).exp())
                .collect()
        };
        let smooth = kernel(&|_| 1.0);
        Self {
            edge: balanced(&kernel(&|x| -x)),
            point: balanced(&kernel(&|x| x * x / (sigma * sigma) - 1.0)),
            smooth: scaled(&smooth, smooth.iter().sum()),
        }
    }
}

fn scaled(kernel: &[f32], divisor: f32) -> Kernel {
    kernel.iter().map(|w| w / divisor).collect()
}

/// Positive weights sum to 1, negative ones to −1.
fn balanced(kernel: &[f32]) -> Kernel {
    let sum = |sign: f32| kernel.iter().map(|w| (sign * w).max(0.0)).sum::<f32>();
    let (positive, negative) = (sum(1.0), sum(-1.0));
    kernel.iter().map(|&w| if w > 0.0 { w / positive } else { w / negative }).collect()
}

/// Rows of numbers.
#[derive(Clone, Debug, Default)]
pub struct Plane {
    pub width: usize,
    pub values: Vec<f32>,
}

impl Plane {
    pub fn rows(&self) -> impl Iterator<Item = &[f32]> {
        self.values.chunks(self.width.max(1))
    }

    /// Each row filtered.
    pub fn along_x(&self, kernel: &Kernel) -> Self {
        let radius = kernel.len() / 2;
        let mut values = vec![0.0; self.values.len()];
        let mut padded = vec![0.0; self.width + 2 * radius];
        for (row, out) in self.rows().zip(values.chunks_mut(self.width.max(1))) {
            let (Some(&first), Some(&last)) = (row.first(), row.last()) else { continue };
            padded[..radius].fill(first);
            padded[radius..radius + self.width].copy_from_slice(row);
            padded[radius + self.width..].fill(last);
            for (k, &w) in kernel.iter().enumerate() {
                add_scaled(out, &padded[k..k + self.width], w);
            }
        }
        Self { width: self.width, values }
    }

    /// The row at `center` filtered along the columns, added to `out`.
    pub fn add_along_y(&self, kernel: &Kernel, center: usize, out: &mut [f32]) {
        let last = (self.values.len() / self.width.max(1)).saturating_sub(1);
        let radius = kernel.len() / 2;
        for (k, &w) in kernel.iter().enumerate() {
            let row = (center + k).saturating_sub(radius).min(last);
            add_scaled(out, &self.values[row * self.width..][..self.width], w);
        }
    }
}

fn add_scaled(out: &mut [f32], row: &[f32], weight: f32) {
    for (out, x) in out.iter_mut().zip(row) {
        *out += weight * x;
    }
}
