//! Length of the bar and its eight derivatives for the A and C tests of chapter 5, written by hand: the reference for
//! the speed of printed code.

/// One reading. `[sin_c, cos_c, sin_a, cos_a]`; errors e_y0a, e_z0a, θ_y0a, θ_z0a, e_x0c, e_y0c, θ_x0c, θ_y0c.
#[inline(always)]
pub fn reading([d, r, h, z_ca]: &[f64; 4], [sc, cc, sa, ca]: &[f64; 4], e: &[f64; 8]) -> (f64, [f64; 8]) {
    let [ey, ez, ty, tz, fx, fy, gx, gy] = *e;
    let z = h - z_ca;
    let (rs, y) = (r * sc, r * cc);
    let px = gy * z - rs + fx;
    let py = y - gx * z + fy;
    let pz = z + gx * y + gy * rs;
    let (qy, qz) = (ca * py - sa * pz, sa * py + ca * pz);
    let bx = px - tz * qy + ty * qz + d;
    let by = qy + tz * px + ey;
    let bz = qz - ty * px + ez;
    let length = (bx * bx + by * by + bz * bz).sqrt();
    let inverse = 1.0 / length;
    let (ux, uy, uz) = (bx * inverse, by * inverse, bz * inverse);
    let vx = ux + tz * uy - ty * uz;
    let (vy, vz) = (uy - tz * ux, uz + ty * ux);
    let (wy, wz) = (ca * vy + sa * vz, ca * vz - sa * vy);
    let gradient = [uy, uz, ux * qz - uz * px, uy * px - ux * qy, vx, wy, wz * y - wy * z, vx * z + wz * rs];
    (length, gradient)
}

/// Evaluates columns of readings.
#[inline(never)]
pub fn columns(
    lengths: &[f64; 4],
    [sc, cc, sa, ca]: [&[f64]; 4],
    errors: &[f64; 8],
    value: &mut [f64],
    [g0, g1, g2, g3, g4, g5, g6, g7]: [&mut [f64]; 8],
) {
    columns_of(lengths, sc, cc, sa, ca, errors, value, g0, g1, g2, g3, g4, g5, g6, g7);
}

/// Takes every column as an argument of its own, so that the compiler knows that no two overlap.
#[inline(never)]
fn columns_of(
    lengths: &[f64; 4],
    sc: &[f64],
    cc: &[f64],
    sa: &[f64],
    ca: &[f64],
    errors: &[f64; 8],
    value: &mut [f64],
    g0: &mut [f64],
    g1: &mut [f64],
    g2: &mut [f64],
    g3: &mut [f64],
    g4: &mut [f64],
    g5: &mut [f64],
    g6: &mut [f64],
    g7: &mut [f64],
) {
    let n = value.len();
    let (sc, cc, sa, ca) = (&sc[..n], &cc[..n], &sa[..n], &ca[..n]);
    let (g0, g1, g2, g3) = (&mut g0[..n], &mut g1[..n], &mut g2[..n], &mut g3[..n]);
    let (g4, g5, g6, g7) = (&mut g4[..n], &mut g5[..n], &mut g6[..n], &mut g7[..n]);
    for i in 0..n {
        let (length, g) = reading(lengths, &[sc[i], cc[i], sa[i], ca[i]], errors);
        value[i] = length;
        g0[i] = g[0];
        g1[i] = g[1];
        g2[i] = g[2];
        g3[i] = g[3];
        g4[i] = g[4];
        g5[i] = g[5];
        g6[i] = g[6];
        g7[i] = g[7];
    }
}
