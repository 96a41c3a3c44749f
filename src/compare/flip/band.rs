//! Some rows of one picture, filtered; and the error between two of them.

use std::{f32::consts::FRAC_1_SQRT_2, ops::Range};

use super::{
    color::{ColorDifference, opponent, seen},
    exposure::tone,
    filter::{Feature, Plane, Spatial},
};
use crate::color::Picture;

/// Kernels for a display.
pub struct Detector {
    spatial: Spatial,
    feature: Feature,
    color: ColorDifference,
}

/// What the eye makes of some rows of a picture, pixel by pixel.
pub struct Band {
    /// CIELAB with Hunt's adjustment, of what the eye resolves.
    colors: Vec<[f32; 3]>,
    /// How much of an edge and of a point each pixel is.
    features: Vec<[f32; 2]>,
}

impl Detector {
    pub fn new(pixels_per_degree: f32) -> Self {
        Self {
            spatial: Spatial::new(pixels_per_degree),
            feature: Feature::new(pixels_per_degree),
            color: ColorDifference::new(),
        }
    }

    /// How many rows further the filters reach.
    fn radius(&self) -> usize {
        self.spatial.yy.len().max(self.feature.smooth.len()) / 2
    }

    pub fn errors(&self, a: &Band, b: &Band) -> impl Iterator<Item = f32> {
        let colors = a.colors.iter().zip(&b.colors).map(|(&a, &b)| self.color.of(a, b));
        let features = a.features.iter().zip(&b.features).map(|(a, b)| {
            // The square root of the larger difference; two of opposite sign are √2 apart.
            (FRAC_1_SQRT_2 * (a[0] - b[0]).abs().max((a[1] - b[1]).abs())).sqrt()
        });
        colors.zip(features).map(|(color, feature)| color.powf(1.0 - feature))
    }
}

impl Band {
    /// `rows` of `picture`, its light multiplied by `factor` and put through the tone curve, or only clipped.
    pub fn new(picture: &Picture, rows: Range<usize>, factor: Option<f32>, detector: &Detector) -> Self {
        let width = picture.width as usize;
        let first = rows.start.saturating_sub(detector.radius());
        let end = (rows.end + detector.radius()).min(picture.height as usize);
        let pixels = &picture.pixels[first * width..end * width];
        let plane = || Plane { width, values: Vec::with_capacity(pixels.len()) };
        let (mut yy, mut cx, mut cz, mut grey) = (plane(), plane(), plane(), plane());
        for pixel in pixels {
            let [y, x, z] = opponent(pixel.map(|c| match factor {
                Some(factor) => tone(c * factor),
                None => c.clamp(0.0, 1.0),
            }));
            yy.values.push(y);
            cx.values.push(x);
            cz.values.push(z);
            grey.values.push((y + 16.0) / 116.0);
        }
        let inside = rows.start - first..rows.end - first;
        Self {
            colors: colors(&detector.spatial, [yy, cx, cz], inside.clone()),
            features: features(&detector.feature, &grey, inside),
        }
    }
}

fn colors(filters: &Spatial, [yy, cx, cz]: [Plane; 3], rows: Range<usize>) -> Vec<[f32; 3]> {
    let width = yy.width;
    let [cz1, cz2] = &filters.cz;
    let (across_yy, across_cx) = (yy.along_x(&filters.yy), cx.along_x(&filters.cx));
    let across_cz = [cz.along_x(cz1), cz.along_x(cz2)];
    let mut colors = Vec::with_capacity(rows.len() * width);
    let (mut y, mut x, mut z) = (vec![0.0; width], vec![0.0; width], vec![0.0; width]);
    for center in rows {
        [&mut y, &mut x, &mut z].into_iter().for_each(|row| row.fill(0.0));
        across_yy.add_along_y(&filters.yy, center, &mut y);
        across_cx.add_along_y(&filters.cx, center, &mut x);
        across_cz[0].add_along_y(cz1, center, &mut z);
        across_cz[1].add_along_y(cz2, center, &mut z);
        colors.extend(y.iter().zip(&x).zip(&z).map(|((&y, &x), &z)| seen([y, x, z])));
    }
    colors
}

/// The lengths of the gradient and of the vector of second derivatives of the filtered grey picture.
fn features(filters: &Feature, grey: &Plane, rows: Range<usize>) -> Vec<[f32; 2]> {
    let width = grey.width;
    let smooth = grey.along_x(&filters.smooth);
    let parts = [
        (grey.along_x(&filters.edge), smooth.clone(), &filters.edge),
        (grey.along_x(&filters.point), smooth, &filters.point),
    ];
    let mut features = vec![[0.0; 2]; rows.len() * width];
    let (mut dx, mut dy) = (vec![0.0; width], vec![0.0; width]);
    for (center, out) in rows.zip(features.chunks_mut(width.max(1))) {
        for (i, (across, smooth, derivative)) in parts.iter().enumerate() {
            dx.fill(0.0);
            dy.fill(0.0);
            across.add_along_y(&filters.smooth, center, &mut dx);
            smooth.add_along_y(derivative, center, &mut dy);
            for ((out, dx), dy) in out.iter_mut().zip(&dx).zip(&dy) {
                out[i] = (dx * dx + dy * dy).sqrt();
            }
        }
    }
    features
}
