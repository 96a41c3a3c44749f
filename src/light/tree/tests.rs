//! Choices against their probabilities, by χ² and by sums over all lights.

use super::*;
use crate::{
    geometry::Frame,
    sampling::{
        stats::{chi2_p_value, r3, uniform},
        warp::uniform_sphere,
    },
};
use glam::Vec2;

/// Lamps of several kinds in a room of 10 m.
fn room(count: u32) -> Vec<Cluster> {
    let lamp = |i: u32| {
        let at = 10.0 * Vec3::from(r3(i));
        let [a, b, power] = r3(i + 5000);
        let axis = uniform_sphere(Vec2::new(a, b));
        match i % 3 {
            0 => Cluster::round([at, at], power),
            1 => Cluster::flat([at - 0.1, at + 0.1], axis, power, i % 6 == 1),
            _ => Cluster::beam(at, axis, 0.2, 0.6, power),
        }
    };
    (0..count).map(lamp).collect()
}

#[test]
fn choices_follow_the_probabilities() {
    for count in [1, 2, 5, 120] {
        let tree = Tree::new(&room(count)).expect("lamps");
        for p in [Vec3::splat(5.0), Vec3::new(-3.0, 2.0, 8.0)] {
            // The last cell: walks that end where neither half reaches p, though their union seemed to.
            let mut expected: Vec<f64> = (0..count as usize).map(|i| tree.probability(p, i) as f64).collect();
            let found = expected.iter().sum::<f64>();
            assert!(found > 0.5 && found < 1.0 + 1e-4, "{count} lamps at {p}: {found}");
            expected.push((1.0 - found).max(0.0));
            let n = 1 << 16;
            let mut observed = vec![0.0; count as usize + 1];
            for i in 0..n {
                let chosen = tree.sample(p, &Receiver::anywhere(), uniform(i, 0));
                if let Some(Choice { light, probability, for_any }) = chosen {
                    assert!((probability / expected[light] as f32 - 1.0).abs() < 1e-4);
                    assert_eq!(probability, for_any);
                }
                observed[chosen.map_or(count as usize, |choice| choice.light)] += 1.0;
            }
            let expected: Vec<f64> = expected.iter().map(|e| e * n as f64).collect();
            assert!(chi2_p_value(&observed, &expected) > 1e-4, "{count} lamps at {p}");
        }
    }
}

/// Of every kind: matte, nearly a mirror, rough, both; seen straight and grazing, from among the lamps and from afar.
fn receivers() -> impl Iterator<Item = (Vec3, Receiver)> {
    let kinds =
        [([1.0, 0.0], 1.0), ([0.0, 1.0], 1e-3), ([0.0, 0.8], 0.4), ([0.5, 0.3], 0.1), ([0.02, 0.9], 1.0)];
    (0..).zip(kinds).flat_map(|(k, (albedos, alpha))| {
        [Vec3::new(0.1, 0.0, 1.0), Vec3::new(0.9, -0.4, 0.01)].map(|wo| {
            let [a, b, c] = r3(k);
            let frame = Frame::from_z(uniform_sphere(Vec2::new(a, b)));
            let p = if c < 0.7 { 10.0 * Vec3::new(b, c, a) } else { Vec3::new(-4.0, 12.0 * a, 5.0) };
            (p, Receiver::new(frame, wo.normalize(), albedos, alpha))
        })
    })
}

/// The probability told with a choice is the one with which it is made, and the other one is that which anybody is told who meets
/// the light by chance.
#[test]
fn choices_for_receivers_follow_the_probabilities() {
    for count in [2, 9, 120] {
        let tree = Tree::new(&room(count)).expect("lamps");
        for (number, (p, receiver)) in receivers().enumerate() {
            let n = 1 << 16;
            let none = count as usize;
            let mut observed = vec![0.0; none + 1];
            let mut told = vec![0.0; none];
            for i in 0..n {
                let chosen = tree.sample(p, &receiver, uniform(i, 7));
                observed[chosen.map_or(none, |choice| choice.light)] += 1.0;
                let Some(Choice { light, probability, for_any }) = chosen else { continue };
                let any = tree.probability(p, light);
                assert!((for_any / any - 1.0).abs() < 1e-4, "{count}, {number}: {for_any}, not {any}");
                assert!(told[light] == 0.0 || told[light] == probability, "{count}, {number}: {light}");
                told[light] = probability;
            }
            let mut expected: Vec<f64> = told.iter().map(|&p| f64::from(p) * f64::from(n)).collect();
            let found = expected.iter().sum::<f64>() / f64::from(n);
            assert!(found < 1.0 + 1e-4, "{count}, {number}: {found}");
            // What was never chosen is rare, walks that end without a light need not be.
            expected.push((f64::from(n) * (1.0 - found)).max(0.0));
            let p_value = chi2_p_value(&observed, &expected);
            assert!(p_value > 1e-4, "{count} lamps, receiver {number}: {p_value:.1e}, {found} found");
        }
    }
}

/// Whatever the receiver, the mean of x / probability over choices is the sum of x over the lights that reach it on the
/// side on which it scatters: none is hidden, and none counts twice.
#[test]
fn receivers_see_every_light_on_their_side_once() {
    let lamps: Vec<_> = (0..150)
        .map(|i| {
            let at = 10.0 * Vec3::from(r3(i));
            Cluster::round([at - 0.05, at + 0.05], r3(i + 900)[1])
        })
        .collect();
    let tree = Tree::new(&lamps).expect("lamps");
    for (k, albedos, alpha) in [(0, [1.0, 0.0], 1.0), (1, [0.3, 0.7], 0.2), (2, [0.0, 1.0], 0.4)] {
        let [a, b, c] = r3(k + 40);
        let (frame, p) = (Frame::from_z(uniform_sphere(Vec2::new(a, b))), Vec3::new(4.0, 5.0 + a, 9.0 * c));
        let wo = Vec3::new(0.6, -0.2, 0.5).normalize();
        let receiver = Receiver::new(frame, wo, albedos, alpha);
        // what such a surface would reflect of each, about
        let reflected = |light: usize| {
            let to = lamps[light].center() - p;
            let wi = frame.to_local(to.normalize());
            let h = (wi + wo).normalize();
            let lobe = (alpha * alpha + (1.0 - h.z * h.z)).powi(-2);
            wi.z.max(0.0) * (albedos[0] + albedos[1] * lobe) / to.length_squared()
        };
        let expected: f32 = (0..lamps.len()).map(reflected).sum();
        let n = 1 << 15;
        let one = |i| {
            let chosen = tree.sample(p, &receiver, uniform(i, k));
            chosen.map_or(0.0, |choice| f64::from(reflected(choice.light) / choice.probability))
        };
        let mean = (0..n).map(one).sum::<f64>() / f64::from(n);
        assert!((mean / f64::from(expected) - 1.0).abs() < 0.01, "{albedos:?}: {mean}, not {expected}");
    }
}

#[test]
fn a_near_lamp_is_preferred_to_far_ones() {
    let lamps: Vec<_> = (0..200).map(|i| Cluster::round([Vec3::new(i as f32, 0.0, 0.0); 2], 1.0)).collect();
    let tree = Tree::new(&lamps).expect("lamps");
    for i in [0, 60, 199] {
        let probability = tree.probability(Vec3::new(i as f32, 0.1, 0.0), i);
        assert!(probability > 0.1, "lamp {i}: {probability}");
    }
}

#[test]
fn odd_arrangements_make_a_whole_tree() {
    let at = |x: f32| Cluster::round([Vec3::new(x, 0.0, 0.0); 2], 1.0);
    let same: Vec<_> = (0..1000).map(|_| at(1.0)).collect();
    let powers: Vec<_> = (0..76).map(|i| at(10f32.powi(i - 38))).collect();
    let far: Vec<_> = (0..50).map(|i| at(if i % 6 == 1 { f32::MAX } else { f32::MIN })).collect();
    for lamps in [same, powers, far] {
        let tree = Tree::new(&lamps).expect("lamps");
        let mut leaves = tree.places.clone();
        leaves.sort_unstable();
        leaves.dedup();
        assert_eq!(leaves.len(), lamps.len());
        let sum: f32 = (0..lamps.len()).map(|i| tree.probability(Vec3::Y, i)).sum();
        assert!(
            (sum - 1.0).abs() < 1e-3 || tree.sample(Vec3::Y, &Receiver::anywhere(), 0.5).is_none(),
            "{sum}"
        );
    }
    assert!(Tree::new(&[]).is_none());
}

#[test]
fn large_trees_are_built_in_parallel_alike() {
    let lamps = room(3 * PARALLEL as u32);
    let [a, b] = [0, 1].map(|_| Tree::new(&lamps).expect("lamps"));
    assert_eq!(a.places, b.places);
    let p = Vec3::splat(3.0);
    let sum: f32 = (0..lamps.len()).map(|i| a.probability(p, i)).sum();
    assert!(sum > 0.5 && sum < 1.001, "{sum}");
}
