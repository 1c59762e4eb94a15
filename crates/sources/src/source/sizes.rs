//! Grids and pitches as people write them.

use crate::length::Length;

/// From one sensor to the next where nobody says it, m.
pub(super) const USUAL_PITCH_M: f64 = 0.01;

/// Rows and columns, such as `31x11`; `None` where `text` is anything else.
pub(super) fn grid_of(text: &str) -> Option<[u32; 2]> {
    let counts: Option<Vec<u32>> = text.split(['x', 'X', '×']).map(|word| word.trim().parse().ok()).collect();
    match counts.as_deref() {
        Some(&[rows, columns]) if rows > 0 && columns > 0 => Some([rows, columns]),
        _ => None,
    }
}

/// The pitch of rows and of columns, m: `8.6mm`, or `8.6mm,5mm`; `None` where `text` is anything else.
pub(super) fn pitch_of(text: &str) -> Option<[f64; 2]> {
    let metres = |word: &str| {
        let length = Length::parse(word.trim()).ok()??;
        Some(length.number * length.unit_m?).filter(|pitch| pitch.is_finite() && *pitch > 0.0)
    };
    let lengths: Option<Vec<f64>> = text.split(',').map(metres).collect();
    match lengths.as_deref() {
        Some(&[pitch]) => Some([pitch; 2]),
        Some(&[rows, columns]) => Some([rows, columns]),
        _ => None,
    }
}
