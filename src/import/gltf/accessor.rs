//! Typed reading of accessors: strides, normalised integers, sparse substitution.
//!
//! glTF 2.0, section 3.6.2 "Accessors". [`check`] looks at all accessors of a document once; an [`Accessor`] then reads
//! single elements in place, in any order, so nothing is allocated on the word of a header. An element that is nowhere
//! (an accessor without `bufferView`) is zero.
//!
//! | stored | normalised value |
//! |---|---|
//! | i8 | max(c / 127, −1) |
//! | u8 | c / 255 |
//! | i16 | max(c / 32767, −1) |
//! | u16 | c / 65535 |

use gltf::json::{
    self,
    accessor::{ComponentType, Type},
    validation::Checked,
};

use super::{
    buffers::Buffers,
    document::Document,
    report::{Problem, Report},
};

/// Elements of an accessor that has no bytes of its own (all zero, or sparse).
const MAX_UNBACKED: u64 = 1 << 24;
/// Sparse substitutions of all accessors of a file together.
const MAX_SPARSE: u64 = 1 << 26;

/// What readers work on: a checked document and its bytes.
pub struct Source<'a> {
    pub document: &'a Document,
    pub buffers: &'a Buffers<'a>,
}

/// Elements at equal distances.
#[derive(Clone, Copy)]
struct Run<'a> {
    bytes: &'a [u8],
    stride: usize,
    size: usize,
}

#[derive(Clone, Copy)]
pub struct Accessor<'a> {
    base: Option<Run<'a>>,
    sparse: Option<Sparse<'a>>,
    pub count: usize,
    pub components: usize,
    pub component: ComponentType,
    pub normalized: bool,
}

/// Replaces the elements named by `indices` (strictly increasing) by `values`.
#[derive(Clone, Copy)]
struct Sparse<'a> {
    count: usize,
    indices: Run<'a>,
    index_type: ComponentType,
    values: Run<'a>,
}

/// Checks every accessor: known types, room in its views, indices of substitutions in order.
pub fn check(source: &Source, report: &mut Report) {
    let mut substitutions = 0u64;
    for (i, json) in source.document.accessors.iter().enumerate() {
        let substituted = json.sparse.as_ref().map_or(0, |s| s.count.0);
        substitutions = substitutions.saturating_add(substituted);
        if substitutions > MAX_SPARSE {
            let message = format!("more than {MAX_SPARSE} sparse substitutions in one file are not read");
            return report.error(Problem::new(format!("/accessors/{i}/sparse/count"), message));
        }
        let checked = source.layout(i, json).and_then(|accessor| accessor.check_substitutions(i));
        if let Err(problem) = checked {
            report.error(problem);
        }
    }
}

impl<'a> Source<'a> {
    /// Accessor `index`, which has passed [`check`]. What its file does not hold reads as zero.
    pub fn accessor(&self, index: usize) -> Result<Accessor<'a>, Problem> {
        match self.document.accessors.get(index) {
            Some(json) => self.layout(index, json),
            None => Err(Problem::new(format!("/accessors/{index}"), "does not exist")),
        }
    }

    /// Whether any element of accessor `index` is given.
    pub fn has_data(&self, index: usize) -> bool {
        self.accessor(index).is_ok_and(|a| a.base.is_some() || a.sparse.is_some())
    }

    fn layout(&self, index: usize, json: &json::Accessor) -> Result<Accessor<'a>, Problem> {
        let problem =
            |rest: &str, message: String| Problem::new(format!("/accessors/{index}{rest}"), message);
        let Checked::Valid(component) = json.component_type else {
            return Err(problem(
                "/componentType",
                "is not a type of glTF (5120 to 5123, 5125 or 5126)".into(),
            ));
        };
        let Checked::Valid(shape) = json.type_ else {
            return Err(problem("/type", "is not SCALAR, VEC2 to VEC4 or MAT2 to MAT4".into()));
        };
        let size = element_size(component.0, shape);
        let offset = json.byte_offset.map_or(0, |o| o.0);
        let base = match json.buffer_view {
            Some(view) => {
                let stride = self.document.views.get(view.value()).and_then(|v| v.byte_stride).map(|s| s.0);
                self.run(view.value(), offset, stride, size, json.count.0).map_err(|m| problem("", m))?
            }
            None if json.count.0 > MAX_UNBACKED => {
                let message =
                    format!("{} elements without data; more than {MAX_UNBACKED} are not read", json.count.0);
                return Err(problem("/count", message));
            }
            None => None,
        };
        let sparse = json.sparse.as_ref().map(|s| self.sparse(s, size, json.count.0)).transpose();
        Ok(Accessor {
            base,
            sparse: sparse.map_err(|m| problem("/sparse", m))?.flatten(),
            count: usize::try_from(json.count.0).map_err(|_| problem("/count", "is too large".into()))?,
            components: shape.multiplicity(),
            component: component.0,
            normalized: json.normalized,
        })
    }

    fn sparse(
        &self,
        json: &json::accessor::sparse::Sparse,
        size: usize,
        of: u64,
    ) -> Result<Option<Sparse<'a>>, String> {
        let Checked::Valid(index_type) = json.indices.component_type else {
            return Err("its indices are not of componentType 5121, 5123 or 5125".into());
        };
        let count = json.count.0;
        if count > of {
            return Err(format!("replaces {count} elements of {of}"));
        }
        let (indices, values) = (&json.indices, &json.values);
        let indices =
            self.run(indices.buffer_view.value(), indices.byte_offset.0, None, index_type.0.size(), count)?;
        let values = self.run(values.buffer_view.value(), values.byte_offset.0, None, size, count)?;
        let (Some(indices), Some(values)) = (indices, values) else { return Ok(None) };
        Ok(Some(Sparse {
            count: usize::try_from(count).unwrap_or(0),
            indices,
            index_type: index_type.0,
            values,
        }))
    }

    /// `count` elements of `size` bytes in a view. `None` where the view has no bytes in this file; then too they must fit.
    fn run(
        &self,
        view: usize,
        offset: u64,
        stride: Option<usize>,
        size: usize,
        count: u64,
    ) -> Result<Option<Run<'a>>, String> {
        let stride = stride.unwrap_or(size);
        if stride < size {
            return Err(format!(
                "elements of {size} bytes overlap: bufferView {view} has byteStride {stride}"
            ));
        }
        let length = self.document.views.get(view).map_or(0, |v| v.byte_length.0);
        let end = match count.checked_sub(1) {
            None => Some(offset),
            Some(steps) => steps
                .checked_mul(stride as u64)
                .and_then(|all| all.checked_add(offset))
                .and_then(|last| last.checked_add(size as u64)),
        };
        if end.is_none_or(|end| end > length) {
            return Err(format!(
                "{count} elements of {size} bytes, {stride} apart from byte {offset}, do not fit the {length} bytes of bufferView {view}"
            ));
        }
        let bytes =
            self.buffers.view(self.document, view).and_then(|all| all.get(usize::try_from(offset).ok()?..));
        Ok(bytes.map(|bytes| Run { bytes, stride, size }))
    }
}

/// Bytes of one element. Columns of matrices begin at multiples of 4 bytes.
fn element_size(component: ComponentType, shape: Type) -> usize {
    let columns = match shape {
        Type::Scalar | Type::Vec2 | Type::Vec3 | Type::Vec4 => {
            return shape.multiplicity() * component.size();
        }
        Type::Mat2 => 2,
        Type::Mat3 => 3,
        Type::Mat4 => 4,
    };
    columns * (columns * component.size()).next_multiple_of(4)
}

impl<'a> Run<'a> {
    fn element(&self, i: usize) -> Option<&'a [u8]> {
        let start = i.checked_mul(self.stride)?;
        self.bytes.get(start..start.checked_add(self.size)?)
    }
}

impl Sparse<'_> {
    fn index(&self, i: usize) -> Option<u32> {
        self.indices.element(i).map(|bytes| unsigned(bytes, self.index_type, 0))
    }
}

impl<'a> Accessor<'a> {
    /// Element `i`, whose missing components are zero.
    pub fn floats<const N: usize>(&self, i: usize) -> [f32; N] {
        let mut out = [0.0; N];
        if let Some(bytes) = self.element(i) {
            for (c, value) in out.iter_mut().enumerate().take(self.components) {
                *value = float(bytes, self.component, self.normalized, c);
            }
        }
        out
    }

    /// Element `i` of unsigned integers, whose missing components are zero.
    pub fn integers<const N: usize>(&self, i: usize) -> [u32; N] {
        let mut out = [0; N];
        if let Some(bytes) = self.element(i) {
            for (c, value) in out.iter_mut().enumerate().take(self.components) {
                *value = unsigned(bytes, self.component, c);
            }
        }
        out
    }

    /// Element `i` of an accessor of vertex indices.
    pub fn vertex(&self, i: usize) -> u32 {
        self.element(i).map_or(0, |bytes| unsigned(bytes, self.component, 0))
    }

    /// The bytes of its elements, and how far apart they begin. `None` where some are replaced, or none is there.
    pub fn plain(&self) -> Option<(&'a [u8], usize)> {
        self.base.filter(|_| self.sparse.is_none()).map(|base| (base.bytes, base.stride))
    }

    /// The bytes of element `i`.
    pub fn element(&self, i: usize) -> Option<&'a [u8]> {
        self.substitute(i).or_else(|| self.base?.element(i))
    }

    fn substitute(&self, i: usize) -> Option<&'a [u8]> {
        let sparse = self.sparse?;
        let (mut low, mut high) = (0, sparse.count);
        while low < high {
            let middle = low + (high - low) / 2;
            match (sparse.index(middle)? as usize).cmp(&i) {
                std::cmp::Ordering::Equal => return sparse.values.element(middle),
                std::cmp::Ordering::Less => low = middle + 1,
                std::cmp::Ordering::Greater => high = middle,
            }
        }
        None
    }

    fn check_substitutions(&self, index: usize) -> Result<(), Problem> {
        let Some(sparse) = self.sparse else { return Ok(()) };
        let pointer = || format!("/accessors/{index}/sparse/indices");
        let mut last = None;
        for i in 0..sparse.count {
            let next = sparse.index(i);
            if next.is_none_or(|n| n as usize >= self.count) {
                return Err(Problem::new(
                    pointer(),
                    format!("its index {i} is beyond the {} elements", self.count),
                ));
            }
            if last.is_some() && next <= last {
                return Err(Problem::new(
                    pointer(),
                    format!("its index {i} is not larger than the one before"),
                ));
            }
            last = next;
        }
        Ok(())
    }
}

fn float(bytes: &[u8], component: ComponentType, normalized: bool, c: usize) -> f32 {
    let whole = |value: f32, most: f32| if normalized { (value / most).max(-1.0) } else { value };
    match component {
        ComponentType::F32 => f32::from_le_bytes(at(bytes, c)),
        ComponentType::I8 => whole(f32::from(i8::from_le_bytes(at(bytes, c))), 127.0),
        ComponentType::U8 => whole(f32::from(u8::from_le_bytes(at(bytes, c))), 255.0),
        ComponentType::I16 => whole(f32::from(i16::from_le_bytes(at(bytes, c))), 32767.0),
        ComponentType::U16 => whole(f32::from(u16::from_le_bytes(at(bytes, c))), 65535.0),
        ComponentType::U32 => u32::from_le_bytes(at(bytes, c)) as f32,
    }
}

fn unsigned(bytes: &[u8], component: ComponentType, c: usize) -> u32 {
    match component {
        ComponentType::U8 | ComponentType::I8 => u8::from_le_bytes(at(bytes, c)).into(),
        ComponentType::U16 | ComponentType::I16 => u16::from_le_bytes(at(bytes, c)).into(),
        ComponentType::U32 | ComponentType::F32 => u32::from_le_bytes(at(bytes, c)),
    }
}

/// Component `c` of an element; zero past its end.
fn at<const N: usize>(bytes: &[u8], c: usize) -> [u8; N] {
    let found = bytes.get(c * N..).and_then(|rest| rest.first_chunk());
    found.copied().unwrap_or([0; N])
}
