//! The table that `rayo compare` prints.

use super::{FileFacts, ImageResult};
use crate::compare::Welch;

const HEADINGS: [&str; 8] =
    ["image", "mean ratio", "relMSE", "block median", "block p95", "PSNR/dB", "LDR-FLIP", "HDR-FLIP"];

/// One line for each image below a line of headings, then what else should be known.
pub fn text(reference: &FileFacts, images: &[ImageResult]) -> String {
    let [width, height] = reference.size;
    let mut text = format!("reference: {}, {width} × {height}\n\n", reference.file);
    let rows: Vec<[String; 8]> =
        std::iter::once(HEADINGS.map(String::from)).chain(images.iter().map(row)).collect();
    let widths: Vec<usize> =
        (0..8).map(|i| rows.iter().map(|row| row[i].chars().count()).max().unwrap_or(0)).collect();
    for row in &rows {
        for (i, (cell, &width)) in row.iter().zip(&widths).enumerate() {
            text += &if i == 0 { format!("{cell:width$}") } else { format!("  {cell:>width$}") };
        }
        text.push('\n');
    }
    let mut remarks: Vec<String> = Vec::new();
    for image in images {
        remarks.extend(image.welch.as_ref().map(|w| format!("{}: {}", image.file.file, verdict(w))));
    }
    for file in std::iter::once(reference).chain(images.iter().map(|image| &image.file)) {
        remarks.extend(file.notes.iter().map(|note| format!("{}: {note}", file.file)));
    }
    if !remarks.is_empty() {
        text.push('\n');
    }
    remarks.into_iter().for_each(|remark| text += &format!("{remark}\n"));
    text
}

fn row(image: &ImageResult) -> [String; 8] {
    let m = &image.numbers.metrics;
    [
        image.file.file.clone(),
        format!("{:.4}", m.mean_ratio),
        format!("{:.3e}", m.rel_mse),
        format!("{:.4}", m.block_median),
        format!("{:.4}", m.block_p95),
        format!("{:.2}", m.psnr),
        format!("{:.4}", image.numbers.ldr_flip),
        format!("{:.4}", image.numbers.hdr_flip),
    ]
}

fn verdict(welch: &Welch) -> String {
    let text = |p: f64| if p < 1e-3 { format!("{p:.1e}") } else { format!("{p:.3}") };
    let [p, blocks, whole] = [welch.p, welch.blocks_p, welch.whole_p].map(text);
    let numbers = format!("Welch test: p = {p} (blocks {blocks}, whole {whole})");
    let [x, y] = welch.worst_block;
    if welch.agrees {
        format!("{numbers}; no difference beyond noise at 1 %")
    } else if welch.blocks_p < welch.whole_p {
        format!("{numbers}; they differ beyond noise at 1 %, the most in the block at {x}, {y}")
    } else {
        format!("{numbers}; they differ beyond noise at 1 %, in the mean of the whole")
    }
}
