//! Colours.

/// Red, green, blue, 0..1, linear light is not claimed.
pub type Rgb = [f32; 3];

/// Stops of the scale: skin, then warm to dark red. Lightness falls all the way, so it reads in grey, too.
const STOPS: [Rgb; 5] =
    [[0.93, 0.82, 0.74], [0.97, 0.72, 0.45], [0.93, 0.47, 0.30], [0.75, 0.20, 0.35], [0.36, 0.08, 0.38]];

/// Colour of `s` in 0..1; clamped outside.
pub fn heat(s: f64) -> Rgb {
    let at = s.clamp(0.0, 1.0) as f32 * (STOPS.len() - 1) as f32;
    let k = (at as usize).min(STOPS.len() - 2);
    let f = at - k as f32;
    std::array::from_fn(|c| STOPS[k][c] + f * (STOPS[k + 1][c] - STOPS[k][c]))
}
