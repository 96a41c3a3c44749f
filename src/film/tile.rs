//! Square parts of the film, each owned by one thread at a time.

use super::{Film, Pixel};

/// A part of the film: `rows[j][i]` is the pixel (x + i, y + j).
pub struct Tile<'a> {
    pub x: u32,
    pub y: u32,
    pub rows: Vec<&'a mut [Pixel]>,
}

impl Film {
    /// Cuts the film into tiles of `side` pixels (less at the right and lower edge), row by row.
    pub fn tiles_mut(&mut self, side: u32) -> Vec<Tile<'_>> {
        let across = self.width.div_ceil(side) as usize;
        let mut tiles = Vec::with_capacity(across * self.height.div_ceil(side) as usize);
        for (y, row) in (0..).zip(self.pixels.chunks_mut(self.width.max(1) as usize)) {
            for (i, part) in (0..).zip(row.chunks_mut(side as usize)) {
                if y % side == 0 {
                    tiles.push(Tile { x: i * side, y, rows: Vec::with_capacity(side as usize) });
                }
                let tile = (y / side) as usize * across + i as usize;
                tiles[tile].rows.push(part);
            }
        }
        tiles
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn tiles_cover_every_pixel_once_where_they_say() {
        for (width, height, side) in [(37, 21, 16), (16, 16, 16), (1, 5, 4), (5, 1, 8)] {
            let mut film = Film::new(width, height).expect("small");
            for tile in film.tiles_mut(side) {
                for (y, row) in (tile.y..).zip(tile.rows) {
                    for (x, pixel) in (tile.x..).zip(row) {
                        pixel.add(Vec3::new(x as f32, y as f32, 1.0));
                    }
                }
            }
            for y in 0..height {
                for x in 0..width {
                    assert_eq!(film.pixel(x, y).taken(), 1);
                    assert_eq!(film.pixel(x, y).mean(), Vec3::new(x as f32, y as f32, 1.0));
                }
            }
        }
    }
}
