use glam::Vec3A;

use super::*;
use crate::world::Model;

fn studio(bounds: &Bounds, camera: Camera, aspect: f64) -> World {
    let mut world = World {
        model: Model::default(),
        spheres: Vec::new(),
        quads: Vec::new(),
        environment: surrounding(),
        camera,
    };
    furnish(&mut world, bounds, aspect);
    world
}

const BOXES: [Bounds; 4] = [
    Bounds::UNIT,
    Bounds { min: DVec3::new(-5.0, 0.0, -1.0), max: DVec3::new(5.0, 0.0, 1.0) },
    Bounds { min: DVec3::new(0.0, 0.0, 0.0), max: DVec3::new(0.1, 8.0, 0.1) },
    Bounds { min: DVec3::new(900.0, 7.0, 7.0), max: DVec3::new(900.0, 7.0, 7.0) },
];

/// The picture as a grid of rays: no quad is hit, and whatever is behind the asset is backdrop.
#[test]
fn the_picture_shows_backdrop_and_no_lights() {
    for bounds in &BOXES {
        for aspect in [0.25, 1.0, 16.0 / 9.0, 4.0] {
            let camera = framing::frame(&Subject::boxed(*bounds), framing::USUAL, aspect as f32);
            let world = studio(bounds, camera, aspect);
            assert_eq!(world.quads.len(), 3, "{bounds:?} {aspect}");
            for (origin, direction) in grid(&world.camera, aspect) {
                let hits_quad = world.quads.iter().any(|quad| {
                    let [o, u, v] = [quad.origin, quad.u, quad.v].map(|p| p.as_dvec3());
                    hits(origin, direction, [o, o + u, o + v])
                        || hits(origin, direction, [o + u, o + u + v, o + v])
                });
                assert!(!hits_quad, "{bounds:?} {aspect}: sees a light");
                let mesh = &world.model.meshes[0];
                let hits_backdrop = mesh.triangles.iter().any(|triangle| {
                    hits(origin, direction, triangle.map(|i| mesh.positions[i as usize].as_dvec3()))
                });
                assert!(hits_backdrop, "{bounds:?} {aspect}: sees past the backdrop along {direction}");
            }
        }
    }
}

/// Lights stand on the asset's side of the backdrop and above its floor.
#[test]
fn lights_are_in_front_of_the_backdrop() {
    for bounds in &BOXES {
        let world = studio(bounds, framing::frame(&Subject::boxed(*bounds), framing::USUAL, 0.25), 0.25);
        let mesh = &world.model.meshes[0];
        let wall = mesh.positions[mesh.positions.len() - 1];
        let outward = mesh.normals[mesh.normals.len() - 1];
        for quad in &world.quads {
            for corner in
                [quad.origin, quad.origin + quad.u, quad.origin + quad.v, quad.origin + quad.u + quad.v]
            {
                assert!((corner - wall).dot(outward) > 0.0 && corner.y > mesh.positions[0].y, "{bounds:?}");
            }
        }
    }
}

/// Radiance of a grey of 0.5 at the asset that faces the camera, and the side of the key: shown as 0.4 to 0.5.
#[test]
fn a_grey_asset_is_well_exposed() {
    let world =
        studio(&Bounds::UNIT, framing::frame(&Subject::boxed(Bounds::UNIT), framing::USUAL, 1.0), 1.0);
    let toward_camera = world.camera.to_world.matrix3.z_axis;
    let radiance = |normal: Vec3A| 0.5 / PI * irradiance(&world, normal.as_dvec3());
    let facing = radiance(toward_camera);
    assert!((0.35..0.5).contains(&facing), "facing the camera {facing}");
    let key = (toward_camera - world.camera.to_world.matrix3.x_axis + Vec3A::Y).normalize();
    let lit = radiance(key);
    assert!((0.42..0.6).contains(&lit), "facing the key {lit}");
    let shadow =
        radiance((toward_camera * 0.3 + world.camera.to_world.matrix3.x_axis - 0.3 * Vec3A::Y).normalize());
    assert!((0.08..0.3).contains(&shadow), "away from the key {shadow}");
}

#[test]
fn odd_cameras_have_no_odd_studio() {
    let looking = |from: DVec3, up: DVec3| {
        let back = from.normalize();
        let right = up.cross(back).normalize();
        let matrix3 = glam::DMat3::from_cols(right, back.cross(right), back).as_mat3();
        Camera {
            to_world: Affine3A::from_mat3_translation(matrix3, from.as_vec3()),
            ..framing::frame(&Subject::boxed(Bounds::UNIT), framing::USUAL, 1.0)
        }
    };
    // From straight above, from below the floor, from within.
    let above = studio(&Bounds::UNIT, looking(DVec3::Y * 9.0, DVec3::NEG_Z), 1.0);
    assert!(above.model.meshes.len() == 1 && above.quads.len() >= 2);
    let below = studio(&Bounds::UNIT, looking(DVec3::new(1.0, -5.0, 5.0), DVec3::Y), 1.0);
    assert!(below.model.meshes.is_empty() && below.quads.len() >= 2);
    let within = studio(&Bounds::UNIT, looking(DVec3::Z * 0.5, DVec3::Y), 1.0);
    assert!(within.model.meshes.is_empty() && within.quads.is_empty());
    for world in [above, below, within] {
        assert!(world.model.meshes.iter().all(|mesh| mesh.positions.iter().all(|p| p.is_finite())));
    }
}

/// A triangle with a point light 2 m above its middle: the studio's lights stand aside for one that can be seen by.
#[test]
fn own_lights_replace_those_of_the_studio() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("lit.gltf");
    let lit = |candela: f32| {
        let corners: Vec<u8> =
            [-1f32, 0., -1., 0., 0., 1., 1., 0., -1.].iter().flat_map(|x| x.to_le_bytes()).collect();
        let data: String = corners.iter().map(|byte| format!("%{byte:02x}")).collect();
        let text = format!(
            r#"{{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[0,1]}}],
            "nodes":[{{"mesh":0}},{{"translation":[0,2,0],"extensions":{{"KHR_lights_punctual":{{"light":0}}}}}}],
            "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],
            "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[-1,0,-1],"max":[1,0,1]}}],
            "bufferViews":[{{"buffer":0,"byteLength":36}}],
            "buffers":[{{"byteLength":36,"uri":"data:application/octet-stream,{data}"}}],
            "extensionsUsed":["KHR_lights_punctual"],
            "extensions":{{"KHR_lights_punctual":{{"lights":[{{"type":"point","intensity":{candela}}}]}}}}}}"#
        );
        std::fs::write(&path, text).expect("written");
        bare_asset(&path, [100, 100], &Selection::default(), None, |_| ()).expect("is read").0
    };
    // A fourth of the candela as W/m².
    for (candela, quads, strength, warnings) in
        [(0.0, 3, 1.0, 0), (1.0, 3, 1.0, 0), (2.0, 0, DIMMED, 0), (30.0, 0, DIMMED, 0), (400.0, 0, DIMMED, 1)]
    {
        let world = lit(candela);
        let found = (world.quads.len(), world.environment.strength, world.model.warnings.len());
        assert_eq!(found, (quads, strength, warnings), "{candela} cd: {:?}", world.model.warnings);
        assert_eq!((world.model.lights.len(), world.model.instances.len()), (1, 1 + quads / 3));
    }
    let help = lit(400.0).model.warnings[0].help.clone();
    assert!(help.is_some_and(|help| help.contains("--exposure -5")));
}

/// Rays through a grid of 17 × 17 points of the picture, its edges included.
fn grid(camera: &Camera, aspect: f64) -> Vec<(DVec3, DVec3)> {
    let Projection::Perspective { vfov } = camera.projection else { panic!("is perspective") };
    let high = f64::from(vfov / 2.0).tan();
    let axes = camera.to_world.matrix3.as_dmat3();
    let ray = |i: i32| {
        let (x, y) = (f64::from(i % 17 - 8) / 8.0, f64::from(i / 17 - 8) / 8.0);
        (camera.to_world.translation.as_dvec3(), axes * DVec3::new(x * high * aspect, y * high, -1.0))
    };
    (0..17 * 17).map(ray).collect()
}

/// Möller and Trumbore's test.
fn hits(origin: DVec3, direction: DVec3, [a, b, c]: [DVec3; 3]) -> bool {
    let (e1, e2, s) = (b - a, c - a, origin - a);
    let p = direction.cross(e2);
    let determinant = p.dot(e1);
    let q = s.cross(e1);
    let (u, v, t) = (p.dot(s) / determinant, q.dot(direction) / determinant, q.dot(e2) / determinant);
    u >= -1e-9 && v >= -1e-9 && u + v <= 1.0 + 1e-9 && t > 0.0
}

/// At the origin, from the lights and the surrounding above and below, without shadows.
fn irradiance(world: &World, normal: DVec3) -> f64 {
    let from_lights = |quad: &Quad| {
        let [o, u, v] = [quad.origin, quad.u, quad.v].map(|p| p.as_dvec3());
        let strength = world.model.materials[quad.material.index()].emission.map_or(0.0, |e| e.strength);
        let area = u.cross(v);
        let cell = |i: i32| {
            let p = o + (f64::from(i % 16) + 0.5) / 16.0 * u + (f64::from(i / 16) + 0.5) / 16.0 * v;
            let way = p.normalize();
            way.dot(normal).max(0.0) * (-way).dot(area).max(0.0) / p.length_squared() / 256.0
        };
        f64::from(strength) * (0..256).map(cell).sum::<f64>()
    };
    let [bottom, top] = SURROUNDING.map(f64::from);
    // The mean over a cosine lobe of a blend that is linear in y.
    let surrounding = PI * (bottom + (top - bottom) * (0.5 + normal.y / 3.0));
    world.quads.iter().map(from_lights).sum::<f64>() + surrounding
}

/// Every sample asset that can be read: seen whole, from a place that is a place.
#[test]
fn sample_assets() {
    let Some(folder) = std::env::var_os("RAYO_SAMPLE_ASSETS") else {
        println!("skipped: RAYO_SAMPLE_ASSETS is not set");
        return;
    };
    let mut folders = vec![std::path::PathBuf::from(folder)];
    while let Some(folder) = folders.pop() {
        for path in
            std::fs::read_dir(folder).into_iter().flatten().filter_map(|entry| Some(entry.ok()?.path()))
        {
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            let aspect = 16.0 / 9.0;
            let Ok((world, ())) = bare_asset(&path, [1600, 900], &Selection::default(), None, |_| ()) else {
                continue;
            };
            assert!(world.camera.to_world.is_finite(), "{}", path.display());
            if world.model.cameras.is_empty() {
                let eye = Eye::new(&world.camera, aspect);
                for instance in world.model.instances.iter().filter(|i| i.name != "studio backdrop") {
                    let mesh = &world.model.meshes[instance.mesh.index()];
                    for &i in mesh.triangles.iter().flatten().step_by(7) {
                        let p = instance.to_world.transform_point3(mesh.positions[i as usize]).as_dvec3();
                        assert!(eye.may_see(&[p]), "{}: {p} is outside the picture", path.display());
                    }
                }
            }
        }
    }
}
