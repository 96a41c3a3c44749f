//! All numbers of meshes and points, in two NumPy files.

use serde::Serialize;

/// Start and length of a part.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Span(usize, usize);

#[derive(Debug, Default)]
pub struct Arrays {
    floats: Vec<f32>,
    integers: Vec<u32>,
}

impl Arrays {
    pub fn floats(&mut self, numbers: impl IntoIterator<Item = f32>) -> Span {
        let start = self.floats.len();
        self.floats.extend(numbers);
        Span(start, self.floats.len() - start)
    }

    pub fn integers(&mut self, numbers: impl IntoIterator<Item = u32>) -> Span {
        let start = self.integers.len();
        self.integers.extend(numbers);
        Span(start, self.integers.len() - start)
    }

    /// `floats.npy` and `integers.npy`.
    pub fn files(&self) -> [(&'static str, Vec<u8>); 2] {
        [
            ("floats.npy", npy("<f4", self.floats.len(), self.floats.iter().map(|n| n.to_le_bytes()))),
            ("integers.npy", npy("<i4", self.integers.len(), self.integers.iter().map(|n| n.to_le_bytes()))),
        ]
    }
}

/// NumPy's format 1.0: a header that ends at a multiple of 64 bytes, then the numbers.
fn npy(kind: &str, len: usize, numbers: impl Iterator<Item = [u8; 4]>) -> Vec<u8> {
    const ALIGN: usize = 64;
    let mut header = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({len},), }}");
    let before = b"\x93NUMPY\x01\x00".len() + 2;
    let end = (before + header.len() + 1).next_multiple_of(ALIGN);
    header.extend(std::iter::repeat_n(' ', end - before - header.len() - 1));
    header.push('\n');
    let mut bytes = Vec::with_capacity(end + 4 * len);
    bytes.extend(b"\x93NUMPY\x01\x00");
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend(numbers.flatten());
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_follow_each_other_behind_an_aligned_header() {
        let mut arrays = Arrays::default();
        assert_eq!(arrays.floats([1.0, 2.0]), Span(0, 2));
        assert_eq!(arrays.floats([3.0]), Span(2, 1));
        assert_eq!(arrays.integers([7]), Span(0, 1));
        let [(_, floats), (_, integers)] = arrays.files();
        assert_eq!((floats.len(), integers.len()), (128 + 12, 128 + 4));
        assert_eq!(floats[128 + 8..], 3f32.to_le_bytes());
        let header = String::from_utf8_lossy(&floats[10..128]);
        assert!(header.starts_with("{'descr': '<f4', 'fortran_order': False, 'shape': (3,), }"), "{header}");
        assert!(header.ends_with('\n'));
    }
}
