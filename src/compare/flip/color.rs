//! The colour spaces of FLIP, and how different two colours are (2020, sections 4.1 and 4.3).
//!
//! Filters run in YyCxCz, a linear space of one achromatic and two opponent axes. Differences are taken in CIELAB with
//! the chroma scaled by luminance (Hunt: colours look fuller when brighter), by the distance HyAB, which is the
//! city-block distance in lightness plus the Euclidean in chroma (Abasi et al. 2020), good for large differences.

/// Linear Rec.709 to XYZ, D65.
const XYZ: [[f32; 3]; 3] = [
    [10_135_552.0 / 24_577_794.0, 8_788_810.0 / 24_577_794.0, 4_435_075.0 / 24_577_794.0],
    [2_613_072.0 / 12_288_897.0, 8_788_810.0 / 12_288_897.0, 887_015.0 / 12_288_897.0],
    [1_425_312.0 / 73_733_382.0, 8_788_810.0 / 73_733_382.0, 70_074_185.0 / 73_733_382.0],
];

/// XYZ to linear Rec.709, to the digits that the authors give.
#[allow(clippy::excessive_precision)]
const RGB: [[f32; 3]; 3] = [
    [3.241_003_275, -1.537_398_934, -0.498_615_861],
    [-0.969_224_334, 1.875_930_071, 0.041_554_224],
    [0.055_639_423, -0.204_011_202, 1.057_148_933],
];

/// XYZ of white, the row sums of [`XYZ`], and its inverse.
const WHITE: [f32; 3] = [0.950_428_55, 1.0, 1.088_900_4];
const INVERSE_WHITE: [f32; 3] = [1.052_156_9, 1.0, 0.918_357_7];

/// Exponent on the distance of colours.
const COLOR_EXPONENT: f32 = 0.7;

/// Distances below 0.4 of the largest possible take up 95 % of the scale.
const KNEE: [f32; 2] = [0.4, 0.95];

fn multiply(m: &[[f32; 3]; 3], v: [f32; 3]) -> [f32; 3] {
    [0, 1, 2].map(|i| m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2])
}

fn relative_xyz(rgb: [f32; 3]) -> [f32; 3] {
    let xyz = multiply(&XYZ, rgb);
    [0, 1, 2].map(|i| xyz[i] * INVERSE_WHITE[i])
}

/// Linear Rec.709 to YyCxCz.
pub fn opponent(rgb: [f32; 3]) -> [f32; 3] {
    let [x, y, z] = relative_xyz(rgb);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// YyCxCz to linear Rec.709.
fn from_opponent([yy, cx, cz]: [f32; 3]) -> [f32; 3] {
    let y = (yy + 16.0) / 116.0;
    multiply(&RGB, [(y + cx / 500.0) * WHITE[0], y * WHITE[1], (y - cz / 200.0) * WHITE[2]])
}

/// Linear Rec.709 to CIELAB with Hunt's adjustment of a and b.
fn hunt_lab(rgb: [f32; 3]) -> [f32; 3] {
    const DELTA: f32 = 6.0 / 29.0;
    let [x, y, z] = relative_xyz(rgb)
        .map(|t| if t > DELTA * DELTA * DELTA { t.cbrt() } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 });
    let lightness = 116.0 * y - 16.0;
    [lightness, 0.01 * lightness * 500.0 * (x - y), 0.01 * lightness * 200.0 * (y - z)]
}

/// A filtered colour in YyCxCz, brought back into the display's gamut, as it is seen.
pub fn seen(filtered: [f32; 3]) -> [f32; 3] {
    hunt_lab(from_opponent(filtered).map(|c| c.clamp(0.0, 1.0)))
}

fn hyab(a: [f32; 3], b: [f32; 3]) -> f32 {
    (a[0] - b[0]).abs() + ((a[1] - b[1]).powi(2) + (a[2] - b[2]).powi(2)).sqrt()
}

/// The difference of two [`seen`] colours, 0 to 1.
#[derive(Clone, Copy, Debug)]
pub struct ColorDifference {
    /// Between green and blue, the two that are furthest apart.
    largest: f32,
}

impl ColorDifference {
    pub fn new() -> Self {
        Self { largest: hyab(hunt_lab([0.0, 1.0, 0.0]), hunt_lab([0.0, 0.0, 1.0])).powf(COLOR_EXPONENT) }
    }

    pub fn of(self, a: [f32; 3], b: [f32; 3]) -> f32 {
        let distance = hyab(a, b).powf(COLOR_EXPONENT);
        let [share, level] = KNEE;
        let knee = share * self.largest;
        if distance < knee {
            distance * level / knee
        } else {
            level + (distance - knee) / (self.largest - knee) * (1.0 - level)
        }
    }
}
