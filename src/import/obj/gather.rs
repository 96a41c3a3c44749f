//! The pieces of a file put together, in order, while the next ones are read: indices become absolute, corners become
//! vertices ([`chains`](super::chains)), polygons become triangles.
//!
//! A face may name vertices that come after it in the file. From the first such face on, faces are kept until all is
//! read.

use std::{collections::HashMap, mem::take, path::Path};

use glam::{DVec3, Vec2, Vec3};
use rayon::prelude::*;

use super::{
    chains::Chains,
    corner::{KINDS, MAX_STATEMENTS, NONE},
    object::Object,
    pieces::Pieces,
    polygon::{Triangulator, newell},
    scan::{MAX_ERRORS, Note, Scanned, Set, scan},
};
use crate::diagnostic::{Diagnostic, Place};

/// A file with more objects than this becomes one mesh: each mesh costs a tree and an instance.
const MAX_OBJECTS: usize = 1000;

/// Marks, among the normals of vertices, an index into [`Gathered::smooth`].
pub(super) const SMOOTH: u32 = 1 << 31;

/// What the statements of vertices hold, over the whole file.
#[derive(Default)]
pub(super) struct Points {
    /// NaN: not finite.
    pub positions: Vec<Vec3>,
    /// sRGB, NaN where there is none; fewer than positions where the last have none.
    pub colors: Vec<Vec3>,
    /// NaN: not finite.
    pub uvs: Vec<Vec2>,
    /// Unit; NaN: none.
    pub normals: Vec<Vec3>,
}

#[derive(Default)]
pub(super) struct Gathered {
    pub points: Points,
    /// In the order of the text.
    pub objects: Vec<Object>,
    /// Of a vertex in a smoothing group: the sum of the group's face normals times their angles there.
    pub smooth: Vec<DVec3>,
    /// Names after `usemtl`, each once.
    pub materials: Vec<String>,
    /// What follows each `mtllib`, with its line.
    pub libraries: Vec<(usize, String)>,
    pub warnings: Vec<Diagnostic>,
}

/// Reads all `pieces` of `file`, several at a time.
pub(super) fn gather(mut pieces: Pieces, file: &Path) -> Result<Gathered, Vec<Diagnostic>> {
    let line_end = pieces.line_end;
    let mut read = || {
        let mut batch = Vec::new();
        while batch.len() < 2 * rayon::current_num_threads() {
            match pieces.next()? {
                Some(piece) => batch.push(piece),
                None => break,
            }
        }
        Ok(batch.into_par_iter().map(|piece| scan(&piece, line_end)).collect::<Vec<_>>())
    };
    let mut gathering = Gathering::default();
    let mut batch = read();
    loop {
        let scanned = batch.map_err(|why: String| {
            vec![Diagnostic::error(file, Place::File, format!("cannot read this OBJ file: {why}"))]
        })?;
        if scanned.is_empty() {
            return gathering.finish(file);
        }
        (_, batch) = rayon::join(|| scanned.into_iter().for_each(|piece| gathering.append(piece)), &mut read);
    }
}

#[derive(Default)]
struct Gathering {
    out: Gathered,
    lines: usize,
    material_ids: HashMap<String, u32>,
    material: Option<u32>,
    /// 0: none.
    smoothing: u32,
    /// The name of an object that has no face yet.
    new_object: Option<String>,
    /// More objects than are kept apart.
    too_many: bool,
    vertices: Chains,
    smooth: Chains,
    triangulator: Triangulator,
    /// How many values are NaN, so that faces need not be looked through where none is.
    bad_positions: usize,
    bad_normals: usize,
    bad_uvs: usize,
    left_out: usize,
    without_slot: usize,
    waiting: Waiting,
    notes: Vec<Note>,
    errors: Vec<(usize, String)>,
    error_count: usize,
    resolved: Vec<Resolved>,
    corners: Vec<Vec3>,
    indices: Vec<u32>,
}

/// `[v, vt, vn]`, from 0, or [`NONE`].
type Resolved = [u32; 3];

/// Faces that wait for vertices to come, and what comes after them.
#[derive(Default)]
struct Waiting {
    steps: Vec<Step>,
    corners: Vec<Resolved>,
}

enum Step {
    Set(Set),
    Face { corners: usize, line: usize },
}

impl Gathering {
    fn append(&mut self, mut piece: Scanned) {
        let before = self.counts();
        self.bad_positions += piece.positions.iter().filter(|p| p.is_nan()).count();
        self.bad_normals += piece.normals.iter().filter(|n| n.is_nan()).count();
        self.bad_uvs += piece.uvs.iter().filter(|uv| uv.is_nan()).count();
        let points = &mut self.out.points;
        if !piece.colors.is_empty() {
            points.colors.resize(points.positions.len(), Vec3::NAN);
            points.colors.append(&mut piece.colors);
        }
        points.positions.append(&mut piece.positions);
        points.uvs.append(&mut piece.uvs);
        points.normals.append(&mut piece.normals);
        let after = self.counts();
        if let Some((_, kind)) = after.iter().zip(KINDS).find(|(count, _)| **count as usize > MAX_STATEMENTS)
        {
            let said = format!("more than {MAX_STATEMENTS} statements of a {kind}");
            self.error(self.lines + piece.lines, said);
            return;
        }
        let mut settings = piece.settings.into_iter().peekable();
        let mut corners = piece.corners.as_slice();
        let mut resolved = take(&mut self.resolved);
        for (number, face) in piece.faces.iter().enumerate() {
            while let Some(setting) = settings.next_if(|setting| setting.face <= number) {
                self.step(setting.set, self.lines + setting.line);
            }
            let Some((these, rest)) = corners.split_at_checked(face.corners as usize) else { break };
            corners = rest;
            resolved.clear();
            let (mut wrong, mut lost) = (false, None);
            for corner in these {
                let mut absolute = [NONE; 3];
                for (kind, (slot, index)) in absolute.iter_mut().zip(corner).enumerate() {
                    match index.resolve(before[kind]) {
                        Some(index) => *slot = index,
                        None if kind == 0 => wrong = true,
                        None => lost = Some(kind),
                    }
                }
                resolved.push(absolute);
            }
            let line = self.lines + face.line as usize;
            if let Some(kind) = lost {
                self.note_lost(kind, line);
            }
            if wrong {
                self.error(line, "an index counts back to before the first vertex".into());
            } else if self.waiting.steps.is_empty() && exist(&resolved, &after) {
                self.face(&resolved);
            } else {
                self.waiting.corners.extend_from_slice(&resolved);
                self.waiting.steps.push(Step::Face { corners: resolved.len(), line });
            }
        }
        self.resolved = resolved;
        for setting in settings {
            self.step(setting.set, self.lines + setting.line);
        }
        for note in piece.notes {
            self.note(Note { first_line: self.lines + note.first_line, ..note });
        }
        self.error_count += piece.error_count;
        self.errors.extend(piece.errors.into_iter().map(|(line, message)| (self.lines + line, message)));
        self.errors.truncate(4 * MAX_ERRORS);
        self.lines += piece.lines;
    }

    fn counts(&self) -> [u32; 3] {
        let points = &self.out.points;
        [points.positions.len(), points.uvs.len(), points.normals.len()]
            .map(|count| u32::try_from(count).unwrap_or(u32::MAX))
    }

    fn error(&mut self, line: usize, message: String) {
        self.error_count += 1;
        if self.errors.len() < 4 * MAX_ERRORS {
            self.errors.push((line, message));
        }
    }

    fn note(&mut self, note: Note) {
        match self.notes.iter_mut().find(|known| known.what == note.what) {
            Some(known) => {
                known.count += note.count;
                if note.first_line < known.first_line {
                    (known.first_line, known.example) = (note.first_line, note.example);
                }
            }
            None => self.notes.push(note),
        }
    }

    /// A face that refers to a texture coordinate or normal that is not there is one without.
    fn note_lost(&mut self, kind: usize, line: usize) {
        let what = "references to texture coordinates and normals that do not exist";
        self.note(Note { what, first_line: line, count: 1, example: format!("a {}", KINDS[kind]) });
    }

    fn step(&mut self, set: Set, line: usize) {
        match set {
            Set::Library(names) => self.out.libraries.push((line, names)),
            set if !self.waiting.steps.is_empty() => self.waiting.steps.push(Step::Set(set)),
            set => self.set(set),
        }
    }

    fn set(&mut self, set: Set) {
        match set {
            Set::Object(name) => self.new_object = Some(name),
            Set::Material(name) => {
                let next = self.out.materials.len() as u32;
                let id = *self.material_ids.entry(name).or_insert_with_key(|name| {
                    self.out.materials.push(name.clone());
                    next
                });
                self.material = Some(id);
            }
            Set::Smoothing(group) => self.smoothing = group,
            Set::Library(_) => {}
        }
    }

    /// Adds a face whose corners all exist.
    fn face(&mut self, corners: &[Resolved]) {
        let positions = &self.out.points.positions;
        let position = |corner: &Resolved| positions.get(corner[0] as usize).copied().unwrap_or(Vec3::NAN);
        if self.bad_positions > 0 && corners.iter().any(|corner| position(corner).is_nan()) {
            self.left_out += 1;
            return;
        }
        let smooth = self.smoothing != 0 && corners.iter().any(|corner| self.file_normal(corner[2]) == NONE);
        if corners.len() > 3 || smooth {
            self.corners.clear();
            self.corners.extend(corners.iter().map(position));
        }
        if self.new_object.is_some() || self.out.objects.is_empty() {
            self.begin_object();
        }
        let mut indices = take(&mut self.indices);
        indices.clear();
        if smooth {
            self.add_to_smooth_normals(corners, &mut indices);
        }
        for (i, corner) in corners.iter().enumerate() {
            let [v, vt, vn] = *corner;
            let bad_uv = |uv: &Vec2| uv.is_nan();
            let vt = if self.bad_uvs > 0 && self.out.points.uvs.get(vt as usize).is_some_and(bad_uv) {
                NONE
            } else {
                vt
            };
            let mut vn = self.file_normal(vn);
            if vn == NONE && smooth {
                vn = indices.get(i).map_or(NONE, |&index| index | SMOOTH);
            }
            let vertex = self.vertices.index(v, [vt, vn]);
            match indices.get_mut(i) {
                Some(slot) => *slot = vertex,
                None => indices.push(vertex),
            }
        }
        self.triangles(&indices);
        self.indices = indices;
    }

    /// `vn`, or [`NONE`] where it has no direction.
    fn file_normal(&self, vn: u32) -> u32 {
        let bad = |normal: &Vec3| normal.is_nan();
        let useless = self.bad_normals > 0 && self.out.points.normals.get(vn as usize).is_some_and(bad);
        if useless { NONE } else { vn }
    }

    fn begin_object(&mut self) {
        let name = self.new_object.take().unwrap_or_default();
        self.end_object();
        self.out.objects.push(Object::new(name));
    }

    /// Gives the last object its vertices.
    fn end_object(&mut self) {
        if let Some(last) = self.out.objects.last_mut() {
            last.vertices = self.vertices.take();
        }
        // From the first that is too many on, there is one that takes up the others.
        self.too_many |= self.out.objects.len() > MAX_OBJECTS;
        if self.too_many {
            let mut all = self.out.objects.drain(..);
            let mut whole = all.next().unwrap_or_default();
            all.for_each(|object| whole.append(object));
            whole.name.clear();
            self.out.objects.push(whole);
        }
    }

    /// Adds the triangles of the polygon whose corners are the vertices `indices`, at `self.corners` if there are more
    /// than three.
    fn triangles(&mut self, indices: &[u32]) {
        let Some(object) = self.out.objects.last_mut() else { return };
        let slot = object.slot(self.material);
        let lost = object.materials.get(usize::from(slot)) != Some(&self.material);
        let first = object.triangles.len();
        if let &[a, b, c] = indices {
            object.triangles.push([a, b, c]);
        } else {
            self.triangulator.triangulate(&self.corners, |triangle| {
                // The triangulator answers with positions in `corners`, which `indices` is as long as.
                if let [Some(&a), Some(&b), Some(&c)] = triangle.map(|i| indices.get(i as usize)) {
                    object.triangles.push([a, b, c]);
                }
            });
        }
        if slot > 0 && object.slots.is_empty() {
            object.slots.resize(first, 0);
        }
        if slot > 0 || !object.slots.is_empty() {
            object.slots.resize(object.triangles.len(), slot);
        }
        if lost {
            self.without_slot += object.triangles.len() - first;
        }
    }

    /// Adds the normal of the polygon at `self.corners` to those of its vertices in this smoothing group, and tells the
    /// indices of these.
    ///
    /// It counts as much as its angle at the vertex is wide (Thürmer and Wüthrich 1998, *Computing Vertex Normals from
    /// Polygonal Facets*), so that it does not matter how a surface is cut up into polygons.
    fn add_to_smooth_normals(&mut self, corners: &[Resolved], indices: &mut Vec<u32>) {
        let normal = newell(&self.corners).try_normalize().unwrap_or(DVec3::ZERO);
        let n = self.corners.len();
        for (i, (corner, here)) in corners.iter().zip(&self.corners).enumerate() {
            let towards =
                |j: usize| self.corners.get(j % n).map_or(DVec3::ZERO, |p| p.as_dvec3() - here.as_dvec3());
            let (next, previous) = (towards(i + 1), towards(i + n - 1));
            // In the polygon's plane and turning with it, so that a reflex corner counts with more than π.
            let angle =
                normal.dot(next.cross(previous)).atan2(next.dot(previous)).rem_euclid(std::f64::consts::TAU);
            let index = self.smooth.index(corner[0], [self.smoothing, 0]);
            if index as usize >= self.out.smooth.len() {
                self.out.smooth.resize(self.smooth.len(), DVec3::ZERO);
            }
            if let Some(sum) = self.out.smooth.get_mut(index as usize) {
                *sum += angle * normal;
            }
            indices.push(index);
        }
    }

    fn finish(mut self, file: &Path) -> Result<Gathered, Vec<Diagnostic>> {
        let Waiting { steps, corners } = take(&mut self.waiting);
        let all = self.counts();
        let mut corners = corners.as_slice();
        for step in steps {
            match step {
                Step::Set(set) => self.set(set),
                Step::Face { corners: count, line } => {
                    let Some((these, rest)) = corners.split_at_checked(count) else { break };
                    corners = rest;
                    let [count, ..] = all;
                    if let Some([index, ..]) = these.iter().find(|[v, ..]| *v >= count) {
                        let index = u64::from(*index) + 1;
                        self.error(line, format!("vertex {index} does not exist: the file has {count}"));
                        continue;
                    }
                    let mut there = these.to_vec();
                    for kind in 1..3 {
                        let wrong = |index: &u32| *index >= all[kind] && *index != NONE;
                        let lost =
                            there.iter_mut().map(|corner| &mut corner[kind]).filter(|index| wrong(index));
                        if lost.map(|index| *index = NONE).count() > 0 {
                            self.note_lost(kind, line);
                        }
                    }
                    self.face(&there);
                }
            }
        }
        self.end_object();
        // Beside the sums it is of no use any more.
        drop(take(&mut self.smooth));
        self.report(file)
    }

    fn report(mut self, file: &Path) -> Result<Gathered, Vec<Diagnostic>> {
        let warning = |place, message| Diagnostic::warning(file, place, message);
        let mut warnings = Vec::new();
        for Note { what, first_line, count, example } in take(&mut self.notes) {
            let message = format!("{count} passed over: {what}; the first is `{example}`");
            warnings.push(warning(Place::Line(first_line), message));
        }
        for (count, what) in [
            (self.left_out, "faces left out because a corner is infinite or not a number"),
            (
                self.triangulator.fanned,
                "concave polygons cut up as if convex, as there are too many so large",
            ),
            (self.without_slot, "triangles with the wrong material, as an object may have 65536"),
        ] {
            if count > 0 {
                warnings.push(warning(Place::File, format!("{what}: {count}")));
            }
        }
        self.errors.sort_by_key(|(line, _)| *line);
        self.errors.truncate(MAX_ERRORS);
        let told = self.errors.len();
        let error = |(line, message)| Diagnostic::error(file, Place::Line(line), message);
        let mut errors: Vec<_> = take(&mut self.errors).into_iter().map(error).collect();
        if self.error_count > told {
            let message = format!("and {} more errors in this file", self.error_count - told);
            errors.push(Diagnostic::error(file, Place::File, message));
        }
        self.out.objects.retain(|object| !object.triangles.is_empty());
        if errors.is_empty() && self.out.objects.is_empty() {
            let (message, help) = if self.left_out > 0 {
                let help = "its vertices are `nan` or `inf`, or too large: export it again";
                ("there is nothing to render: no face has finite corners", help)
            } else {
                let help = "export a mesh of polygons (`v` and `f` statements)";
                match self.out.points.positions.is_empty() {
                    true => ("this is no OBJ file: it holds neither vertices nor faces", help),
                    false => ("there is nothing to render: the file holds no faces", help),
                }
            };
            errors.push(Diagnostic::error(file, Place::File, message).help(help));
        }
        self.out.warnings = warnings;
        if errors.is_empty() {
            return Ok(self.out);
        }
        errors.append(&mut self.out.warnings);
        Err(errors)
    }
}

fn exist(corners: &[Resolved], counts: &[u32; 3]) -> bool {
    corners
        .iter()
        .all(|corner| corner.iter().zip(counts).all(|(&index, &count)| index < count || index == NONE))
}
