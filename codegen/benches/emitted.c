/*
 * Length read by a ball bar: w C A b Y X Z t; exact in the errors, small-angle rotations I + [θ]×.
 * Written by Abbe 0.1.0.
 *
 * Arguments in order:
 *   lengths[0]   d            mm   length of the set-up
 *   lengths[1]   r            mm   length of the set-up
 *   lengths[2]   h            mm   length of the set-up
 *   lengths[3]   z_ca         mm   length of the set-up
 *   axes[0]      sin_c        1    sine of the angle of axis C
 *   axes[1]      cos_c        1    cosine of the angle of axis C
 *   axes[2]      sin_a        1    sine of the angle of axis A
 *   axes[3]      cos_a        1    cosine of the angle of axis A
 *   errors[0]    e_y0a        mm   location of A in Y (EY0A)
 *   errors[1]    e_z0a        mm   location of A in Z (EZ0A)
 *   errors[2]    theta_y0a    rad  orientation of A about Y (EB0A)
 *   errors[3]    theta_z0a    rad  orientation of A about Z (EC0A)
 *   errors[4]    e_x0c        mm   location of C in X (EX0C)
 *   errors[5]    e_y0c        mm   location of C in Y (EY0C)
 *   errors[6]    theta_x0c    rad  orientation of C about X (EA0C)
 *   errors[7]    theta_y0c    rad  orientation of C about Y (EB0C)
 * Value: the length read, mm. Gradient: by errors[0], errors[1] and so on, mm/mm and mm/rad.
 * Value and gradient: 66 operations per reading (28 + and −, 36 ·, 1 /, 1 √).
 * Checked against the chain with dual numbers at 40 points, errors to ±10 mm and ±0.1 rad: largest relative difference 0 (value), 7e-16 (gradient).
 * Largest deviation from the exact chain over C −180° to 180°, A −20° to 70°: 0.0054 µm at errors of ±10 µm and ±0.01°, 0.54 µm at errors of ±100 µm and ±0.1°.
 * Columns: n readings; axes[a * n + i] and the results value[j * n + i], gradient[(j * 8 + k) * n + i] of reading i.
 * Compile with -O3 -fno-math-errno, otherwise the square root prevents vectorisation of the loop over readings.
 */
#include <math.h>
#include <stddef.h>

/* Value of one reading. */
void bar_length(const double *lengths, const double *axes, const double *errors, double *value);

void bar_length(const double *lengths, const double *axes, const double *errors, double *value)
{
    const double d = lengths[0];
    const double r = lengths[1];
    const double h = lengths[2];
    const double z_ca = lengths[3];
    const double sin_c = axes[0];
    const double cos_c = axes[1];
    const double sin_a = axes[2];
    const double cos_a = axes[3];
    const double e_y0a = errors[0];
    const double e_z0a = errors[1];
    const double theta_y0a = errors[2];
    const double theta_z0a = errors[3];
    const double e_x0c = errors[4];
    const double e_y0c = errors[5];
    const double theta_x0c = errors[6];
    const double theta_y0c = errors[7];
    const double pt_a_z = h - z_ca;
    const double t1 = r * sin_c;
    const double pt_a_y = r * cos_c;
    const double p_a_z = pt_a_z + (theta_x0c * pt_a_y + theta_y0c * t1);
    const double p_a_x = theta_y0c * pt_a_z - t1 + e_x0c;
    const double p_a_y = pt_a_y - theta_x0c * pt_a_z + e_y0c;
    const double pt_r_y = p_a_y * cos_a - p_a_z * sin_a;
    const double pt_r_z = p_a_y * sin_a + p_a_z * cos_a;
    const double p_r_x = p_a_x + (theta_y0a * pt_r_z - theta_z0a * pt_r_y);
    const double p_r_y = pt_r_y + theta_z0a * p_a_x + e_y0a;
    const double p_r_z = pt_r_z - theta_y0a * p_a_x + e_z0a;
    const double b_x = p_r_x + d;
    const double reading = sqrt(b_x * b_x + p_r_y * p_r_y + p_r_z * p_r_z);
    value[0] = reading;
}

/* Value of n readings. */
void bar_length_columns(size_t n, const double *restrict lengths, const double *restrict axes, const double *restrict errors, double *restrict value);

void bar_length_columns(size_t n, const double *restrict lengths, const double *restrict axes, const double *restrict errors, double *restrict value)
{
    const double *restrict column_sin_c = axes + 0 * n;
    const double *restrict column_cos_c = axes + 1 * n;
    const double *restrict column_sin_a = axes + 2 * n;
    const double *restrict column_cos_a = axes + 3 * n;
    double *restrict value_0 = value + 0 * n;
    const double d = lengths[0];
    const double r = lengths[1];
    const double h = lengths[2];
    const double z_ca = lengths[3];
    const double e_y0a = errors[0];
    const double e_z0a = errors[1];
    const double theta_y0a = errors[2];
    const double theta_z0a = errors[3];
    const double e_x0c = errors[4];
    const double e_y0c = errors[5];
    const double theta_x0c = errors[6];
    const double theta_y0c = errors[7];
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC ivdep
#endif
    for (size_t i = 0; i < n; ++i) {
        const double sin_c = column_sin_c[i];
        const double cos_c = column_cos_c[i];
        const double sin_a = column_sin_a[i];
        const double cos_a = column_cos_a[i];
        const double pt_a_z = h - z_ca;
        const double t1 = r * sin_c;
        const double pt_a_y = r * cos_c;
        const double p_a_z = pt_a_z + (theta_x0c * pt_a_y + theta_y0c * t1);
        const double p_a_x = theta_y0c * pt_a_z - t1 + e_x0c;
        const double p_a_y = pt_a_y - theta_x0c * pt_a_z + e_y0c;
        const double pt_r_y = p_a_y * cos_a - p_a_z * sin_a;
        const double pt_r_z = p_a_y * sin_a + p_a_z * cos_a;
        const double p_r_x = p_a_x + (theta_y0a * pt_r_z - theta_z0a * pt_r_y);
        const double p_r_y = pt_r_y + theta_z0a * p_a_x + e_y0a;
        const double p_r_z = pt_r_z - theta_y0a * p_a_x + e_z0a;
        const double b_x = p_r_x + d;
        const double reading = sqrt(b_x * b_x + p_r_y * p_r_y + p_r_z * p_r_z);
        value_0[i] = reading;
    }
}

/* Value and gradient of one reading. */
void bar_length_gradient(const double *lengths, const double *axes, const double *errors, double *value, double *gradient);

void bar_length_gradient(const double *lengths, const double *axes, const double *errors, double *value, double *gradient)
{
    const double d = lengths[0];
    const double r = lengths[1];
    const double h = lengths[2];
    const double z_ca = lengths[3];
    const double sin_c = axes[0];
    const double cos_c = axes[1];
    const double sin_a = axes[2];
    const double cos_a = axes[3];
    const double e_y0a = errors[0];
    const double e_z0a = errors[1];
    const double theta_y0a = errors[2];
    const double theta_z0a = errors[3];
    const double e_x0c = errors[4];
    const double e_y0c = errors[5];
    const double theta_x0c = errors[6];
    const double theta_y0c = errors[7];
    const double pt_a_z = h - z_ca;
    const double t1 = r * sin_c;
    const double pt_a_y = r * cos_c;
    const double p_a_z = pt_a_z + (theta_x0c * pt_a_y + theta_y0c * t1);
    const double p_a_x = theta_y0c * pt_a_z - t1 + e_x0c;
    const double p_a_y = pt_a_y - theta_x0c * pt_a_z + e_y0c;
    const double pt_r_y = p_a_y * cos_a - p_a_z * sin_a;
    const double pt_r_z = p_a_y * sin_a + p_a_z * cos_a;
    const double p_r_x = p_a_x + (theta_y0a * pt_r_z - theta_z0a * pt_r_y);
    const double p_r_y = pt_r_y + theta_z0a * p_a_x + e_y0a;
    const double p_r_z = pt_r_z - theta_y0a * p_a_x + e_z0a;
    const double b_x = p_r_x + d;
    const double reading = sqrt(b_x * b_x + p_r_y * p_r_y + p_r_z * p_r_z);
    const double t2 = 1.0 / reading;
    const double u_z = t2 * p_r_z;
    const double u_y = t2 * p_r_y;
    const double u_x = t2 * b_x;
    const double ut_r_x = u_x - u_z * theta_y0a + u_y * theta_z0a;
    const double ut_r_y = u_y - u_x * theta_z0a;
    const double ut_r_z = u_z + u_x * theta_y0a;
    const double u_a_z = ut_r_z * cos_a - ut_r_y * sin_a;
    const double u_a_y = ut_r_z * sin_a + ut_r_y * cos_a;
    value[0] = reading;
    gradient[0] = u_y;
    gradient[1] = u_z;
    gradient[2] = u_x * pt_r_z - u_z * p_a_x;
    gradient[3] = u_y * p_a_x - u_x * pt_r_y;
    gradient[4] = ut_r_x;
    gradient[5] = u_a_y;
    gradient[6] = u_a_z * pt_a_y - u_a_y * pt_a_z;
    gradient[7] = u_a_z * t1 + ut_r_x * pt_a_z;
}

/* Value and gradient of n readings. */
void bar_length_gradient_columns(size_t n, const double *restrict lengths, const double *restrict axes, const double *restrict errors, double *restrict value, double *restrict gradient);

void bar_length_gradient_columns(size_t n, const double *restrict lengths, const double *restrict axes, const double *restrict errors, double *restrict value, double *restrict gradient)
{
    const double *restrict column_sin_c = axes + 0 * n;
    const double *restrict column_cos_c = axes + 1 * n;
    const double *restrict column_sin_a = axes + 2 * n;
    const double *restrict column_cos_a = axes + 3 * n;
    double *restrict value_0 = value + 0 * n;
    double *restrict gradient_0 = gradient + 0 * n;
    double *restrict gradient_1 = gradient + 1 * n;
    double *restrict gradient_2 = gradient + 2 * n;
    double *restrict gradient_3 = gradient + 3 * n;
    double *restrict gradient_4 = gradient + 4 * n;
    double *restrict gradient_5 = gradient + 5 * n;
    double *restrict gradient_6 = gradient + 6 * n;
    double *restrict gradient_7 = gradient + 7 * n;
    const double d = lengths[0];
    const double r = lengths[1];
    const double h = lengths[2];
    const double z_ca = lengths[3];
    const double e_y0a = errors[0];
    const double e_z0a = errors[1];
    const double theta_y0a = errors[2];
    const double theta_z0a = errors[3];
    const double e_x0c = errors[4];
    const double e_y0c = errors[5];
    const double theta_x0c = errors[6];
    const double theta_y0c = errors[7];
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC ivdep
#endif
    for (size_t i = 0; i < n; ++i) {
        const double sin_c = column_sin_c[i];
        const double cos_c = column_cos_c[i];
        const double sin_a = column_sin_a[i];
        const double cos_a = column_cos_a[i];
        const double pt_a_z = h - z_ca;
        const double t1 = r * sin_c;
        const double pt_a_y = r * cos_c;
        const double p_a_z = pt_a_z + (theta_x0c * pt_a_y + theta_y0c * t1);
        const double p_a_x = theta_y0c * pt_a_z - t1 + e_x0c;
        const double p_a_y = pt_a_y - theta_x0c * pt_a_z + e_y0c;
        const double pt_r_y = p_a_y * cos_a - p_a_z * sin_a;
        const double pt_r_z = p_a_y * sin_a + p_a_z * cos_a;
        const double p_r_x = p_a_x + (theta_y0a * pt_r_z - theta_z0a * pt_r_y);
        const double p_r_y = pt_r_y + theta_z0a * p_a_x + e_y0a;
        const double p_r_z = pt_r_z - theta_y0a * p_a_x + e_z0a;
        const double b_x = p_r_x + d;
        const double reading = sqrt(b_x * b_x + p_r_y * p_r_y + p_r_z * p_r_z);
        const double t2 = 1.0 / reading;
        const double u_z = t2 * p_r_z;
        const double u_y = t2 * p_r_y;
        const double u_x = t2 * b_x;
        const double ut_r_x = u_x - u_z * theta_y0a + u_y * theta_z0a;
        const double ut_r_y = u_y - u_x * theta_z0a;
        const double ut_r_z = u_z + u_x * theta_y0a;
        const double u_a_z = ut_r_z * cos_a - ut_r_y * sin_a;
        const double u_a_y = ut_r_z * sin_a + ut_r_y * cos_a;
        value_0[i] = reading;
        gradient_0[i] = u_y;
        gradient_1[i] = u_z;
        gradient_2[i] = u_x * pt_r_z - u_z * p_a_x;
        gradient_3[i] = u_y * p_a_x - u_x * pt_r_y;
        gradient_4[i] = ut_r_x;
        gradient_5[i] = u_a_y;
        gradient_6[i] = u_a_z * pt_a_y - u_a_y * pt_a_z;
        gradient_7[i] = u_a_z * t1 + ut_r_x * pt_a_z;
    }
}
