//! Nodes, scenes and skins: transforms, morph weights, and joints that belong together.
//!
//! References and the hierarchy itself are looked at by `check`, which refuses what is wrong there; a cycle does no harm here.

use glam::{DMat3, DVec3};

use super::{
    asset::{Asset, index_of, list, members, numbers, whole},
    findings::Findings,
};

/// How far a column of a node's matrix may lean from the others, as a cosine.
const SKEW: f64 = 5e-3;

pub fn check(asset: Asset, findings: &mut Findings) {
    let tree = Tree::of(asset);
    for (i, node) in asset.items("nodes") {
        if let Some(matrix) = numbers::<16>(node.get("matrix"))
            && !is_decomposable(&matrix)
        {
            let message = "is not a product of translation, rotation and scale";
            findings.add("transforms", format!("/nodes/{i}/matrix"), message);
        }
        let Some(mesh) = asset.item("meshes", index_of(node, "mesh")) else { continue };
        let primitives = list(mesh.get("primitives"));
        if let Some(weights) = node.get("weights") {
            let targets = primitives.first().map_or(0, |primitive| list(primitive.get("targets")).len());
            let weights = list(Some(weights)).len();
            if weights != targets {
                let message = format!("has {weights} elements for {targets} morph targets");
                findings.add("morph weights", format!("/nodes/{i}/weights"), message);
            }
        }
        if let Some(skin) = asset.item("skins", index_of(node, "skin")) {
            let skinned = |attributes| members(attributes).any(|(name, _)| name.starts_with("JOINTS_"));
            if !primitives.iter().any(|primitive| skinned(primitive.get("attributes"))) {
                findings.add("skins", format!("/nodes/{i}"), "has a skin, but its mesh has no joints");
            } else if let Some(scene) = scene_without(asset, &tree, i, skin) {
                let message = format!("is a skinned mesh of scene {scene}, in which its joints are not");
                findings.add("skins", format!("/nodes/{i}"), message);
            }
        }
    }
    for (i, skin) in asset.items("skins") {
        let joints: Vec<usize> = list(skin.get("joints")).iter().filter_map(node_index).collect();
        let mut roots = joints.iter().filter_map(|&joint| tree.root(joint));
        let first = roots.next();
        if roots.any(|root| Some(root) != first) {
            findings.add("skins", format!("/skins/{i}/joints"), "has no node above all of its joints");
        } else if let Some(skeleton) = index_of(skin, "skeleton")
            && !joints.iter().all(|&joint| tree.is_above(skeleton, joint))
        {
            let message = format!("is node {skeleton}, which is not above all joints");
            findings.add("skins", format!("/skins/{i}/skeleton"), message);
        }
    }
}

fn node_index(value: &serde_json::Value) -> Option<usize> {
    usize::try_from(whole(value)?).ok()
}

/// A scene with node `node` in which the joints of `skin` are not.
fn scene_without(asset: Asset, tree: &Tree, node: usize, skin: &serde_json::Value) -> Option<usize> {
    let joint = tree.root(list(skin.get("joints")).first().and_then(node_index)?)?;
    let root = tree.root(node)?;
    let holds = |scene: &serde_json::Value, root| {
        list(scene.get("nodes")).iter().any(|n| node_index(n) == Some(root))
    };
    asset.items("scenes").find(|(_, scene)| holds(scene, root) && !holds(scene, joint)).map(|(i, _)| i)
}

/// Whether the last row is (0, 0, 0, 1) and the columns stand upright on one another.
fn is_decomposable(m: &[f64; 16]) -> bool {
    let column = |c: usize| DVec3::new(m[4 * c], m[4 * c + 1], m[4 * c + 2]);
    let axes = [0, 1, 2].map(|c| column(c).normalize_or_zero());
    let determinant = DMat3::from_cols(column(0), column(1), column(2)).determinant();
    let upright = [(0, 1), (1, 2), (2, 0)].iter().all(|&(a, b)| axes[a].dot(axes[b]).abs() <= SKEW);
    let is_finite = m.iter().all(|&value| (value as f32).is_finite());
    is_finite && [m[3], m[7], m[11], m[15]] == [0.0, 0.0, 0.0, 1.0] && upright && determinant != 0.0
}

/// Where each node stands in the hierarchy.
#[derive(Clone, Copy, Default)]
struct Standing {
    /// `None` in a cycle, which has no root.
    root: Option<usize>,
    /// When a walk over all trees, children after their parents, comes to the node, and when it has left its last child.
    enter: usize,
    leave: usize,
}

struct Tree(Vec<Standing>);

impl Tree {
    fn of(asset: Asset) -> Self {
        let count = asset.count("/nodes");
        let children = |i: usize| list(asset.item("nodes", Some(i)).and_then(|node| node.get("children")));
        let mut is_child = vec![false; count];
        for child in (0..count).flat_map(children).filter_map(node_index) {
            if let Some(flag) = is_child.get_mut(child) {
                *flag = true;
            }
        }
        let mut standings = vec![Standing::default(); count];
        let mut time = 0;
        for root in (0..count).filter(|&i| is_child.get(i) == Some(&false)) {
            let mut pending = vec![(root, false)];
            while let Some((node, is_left)) = pending.pop() {
                let Some(standing) = standings.get_mut(node) else { continue };
                if is_left {
                    standing.leave = time;
                } else if standing.root.is_none() {
                    time += 1;
                    *standing = Standing { root: Some(root), enter: time, leave: time };
                    pending.push((node, true));
                    pending.extend(children(node).iter().filter_map(node_index).map(|child| (child, false)));
                }
            }
        }
        Self(standings)
    }

    fn root(&self, node: usize) -> Option<usize> {
        self.0.get(node)?.root
    }

    /// Whether `node` is `below` or one of those above it. So are all things in cycles.
    fn is_above(&self, node: usize, below: usize) -> bool {
        let (Some(a), Some(b)) = (self.0.get(node), self.0.get(below)) else { return true };
        a.root.is_none() || b.root.is_none() || (a.enter <= b.enter && b.leave <= a.leave)
    }
}
