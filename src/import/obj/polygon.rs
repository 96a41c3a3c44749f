//! Polygons into triangles.
//!
//! A polygon is looked at along its normal (Newell's: the sum of the cross products of successive corners, which is
//! twice the vector area, so it is defined for non-planar and concave polygons as well). Where every triangle of the
//! fan from the first corner is then counter-clockwise, that fan tiles the polygon; where not, ears are clipped.

use glam::{DVec2, DVec3, Vec3};

/// Clipping ears may take time in the square of the corners. Where the sum of the squares over a file comes to this
/// (two seconds where they cross themselves), the rest is fanned: real files stay far below.
const MAX_CLIPPING: usize = 1 << 27;

/// Twice the vector area. Its direction is the normal of the side from which the corners run counter-clockwise.
pub(super) fn newell(corners: &[Vec3]) -> DVec3 {
    let Some(origin) = corners.first().map(|p| p.as_dvec3()) else { return DVec3::ZERO };
    let from_origin = |p: &Vec3| p.as_dvec3() - origin;
    corners.windows(2).map(|pair| from_origin(&pair[0]).cross(from_origin(&pair[1]))).sum()
}

/// What is kept from one polygon of a file to the next.
#[derive(Default)]
pub(super) struct Triangulator {
    /// Polygons fanned though they are concave.
    pub fanned: usize,
    clipping: usize,
    ears: earcut::Earcut<f64>,
    plane: Vec<[f64; 2]>,
    clipped: Vec<u32>,
}

impl Triangulator {
    /// Calls `each` with the triangles of a polygon, as positions in `corners`, wound as the polygon is.
    pub fn triangulate(&mut self, corners: &[Vec3], mut each: impl FnMut([u32; 3])) {
        let fan = (2..corners.len() as u32).map(|last| [0, last - 1, last]);
        if corners.len() > 3 {
            self.project(corners);
            let concave = !fan.clone().all(|t| area(&self.plane, t) >= 0.0);
            let clipping = self.clipping.saturating_add(corners.len().saturating_pow(2));
            if concave && clipping > MAX_CLIPPING {
                self.fanned += 1;
            } else if concave {
                self.clipping = clipping;
                self.ears.earcut_slice(&self.plane, &[], &mut self.clipped);
                if !self.clipped.is_empty() {
                    self.clipped.as_chunks().0.iter().for_each(|&triangle| each(triangle));
                    return;
                }
            }
        }
        fan.for_each(each);
    }

    /// Drops the axis that the normal leans to most: unlike a rotation this rounds nothing, so corners in line stay so.
    fn project(&mut self, corners: &[Vec3]) {
        let normal = newell(corners);
        let size = normal.abs();
        let flat = |p: DVec3| {
            if size.z >= size.x && size.z >= size.y {
                [p.x, p.y * normal.z.signum()]
            } else if size.x >= size.y {
                [p.y, p.z * normal.x.signum()]
            } else {
                [p.z, p.x * normal.y.signum()]
            }
        };
        self.plane.clear();
        self.plane.extend(corners.iter().map(|p| flat(p.as_dvec3())));
    }
}

/// Twice the signed area; an index out of range counts as a triangle without area.
fn area(plane: &[[f64; 2]], triangle: [u32; 3]) -> f64 {
    let [a, b, c] = triangle.map(|i| plane.get(i as usize).map_or(DVec2::ZERO, |&p| DVec2::from(p)));
    (b - a).perp_dot(c - a)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangles(corners: &[Vec3]) -> Vec<[u32; 3]> {
        let mut all = Vec::new();
        Triangulator::default().triangulate(corners, |t| all.push(t));
        all
    }

    /// Sum of the areas (unsigned) and of the vector areas of the triangles, doubled.
    fn areas(corners: &[Vec3]) -> (f64, DVec3) {
        let all = triangles(corners);
        let each = all.iter().map(|t| newell(&t.map(|i| corners[i as usize])));
        (each.clone().map(DVec3::length).sum(), each.sum())
    }

    /// An arrow head, a comb and an L, in three planes and both windings.
    #[test]
    fn concave_polygons_are_tiled_without_overlap() {
        let shapes: [&[(f32, f32)]; 3] = [
            &[(0.0, 0.0), (2.0, 1.0), (0.0, 2.0), (1.0, 1.0)],
            &[(0.0, 0.0), (5.0, 0.0), (5.0, 3.0), (4.0, 1.0), (3.0, 3.0), (2.0, 1.0), (1.0, 3.0), (0.0, 3.0)],
            &[(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0)],
        ];
        type Place = fn(f32, f32) -> Vec3;
        let planes: [Place; 3] = [
            |x, y| Vec3::new(x, y, 7.0),
            |x, y| Vec3::new(-3.0, x, y),
            |x, y| Vec3::new(x, 0.3 * x + 0.2 * y, y),
        ];
        for shape in shapes {
            for plane in planes {
                let mut corners: Vec<Vec3> = shape.iter().map(|&(x, y)| plane(x, y)).collect();
                for _ in 0..2 {
                    let whole = newell(&corners);
                    let (sum, vector) = areas(&corners);
                    assert_eq!(triangles(&corners).len(), corners.len() - 2);
                    assert!(
                        (sum - whole.length()).abs() < 1e-5 * sum,
                        "{corners:?}: {sum}, {}",
                        whole.length()
                    );
                    assert!(vector.distance(whole) < 1e-5 * sum, "wound the other way");
                    corners.reverse();
                }
            }
        }
    }

    #[test]
    fn convex_polygons_keep_the_fan_that_others_draw_too() {
        let square = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(x, y)| Vec3::new(x, y, 0.0));
        assert_eq!(triangles(&square), [[0, 1, 2], [0, 2, 3]]);
    }

    #[test]
    fn a_bent_quad_keeps_its_corners_and_side() {
        let bent = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.3), (1.0, 1.0, 0.0), (0.0, 1.0, 0.3)].map(Vec3::from);
        assert!(areas(&bent).1.distance(newell(&bent)) < 1e-6);
        assert_eq!(triangles(&bent).len(), 2);
    }

    #[test]
    fn clipping_ends_where_it_would_take_too_long() {
        let star = |n: usize| -> Vec<Vec3> {
            let angle = |i: usize| (i * 7919 % n) as f32;
            (0..n).map(|i| Vec3::new(angle(i).cos(), angle(i).sin(), 0.0)).collect()
        };
        let mut triangulator = Triangulator::default();
        triangulator.triangulate(&star(40_000), |_| {});
        assert_eq!(triangulator.fanned, 1);
    }

    #[test]
    fn polygons_without_area_do_no_harm() {
        for n in 0..9 {
            triangles(&vec![Vec3::ONE; n]);
            triangles(&(0..n).map(|i| Vec3::X * i as f32).collect::<Vec<_>>());
            triangles(
                &(0..n)
                    .map(|i| Vec3::splat(if i % 2 == 0 { f32::MAX } else { f32::MIN }))
                    .collect::<Vec<_>>(),
            );
        }
    }
}
