/* SPDX-License-Identifier: BSD-3-Clause */
/* Frames of foreign models, as numbers. */
#include "exchange/formats/foreign_frames.h"
#include <math.h>
#include <string.h>

/* Entries of rotations by multiples of a right angle are exact, so that the equations remain short. */
static double without_rounding(double x)
{
    return fabs(x) < 1e-15 ? 0 : fabs(fabs(x) - 1) < 1e-15 ? copysign(1, x) : x;
}

static void tidy(double r[3][3])
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            r[i][j] = without_rounding(r[i][j]);
}

void kmp_frame_rotate(const double rpy[3], double r[3][3])
{
    double c[3], s[3];
    for (int k = 0; k < 3; k++) {
        c[k] = without_rounding(cos(rpy[k]));
        s[k] = without_rounding(sin(rpy[k]));
    }
    const double of[3][3] = {{c[2] * c[1], c[2] * s[1] * s[0] - s[2] * c[0], c[2] * s[1] * c[0] + s[2] * s[0]},
                             {s[2] * c[1], s[2] * s[1] * s[0] + c[2] * c[0], s[2] * s[1] * c[0] - c[2] * s[0]},
                             {-s[1], c[1] * s[0], c[1] * c[0]}};
    memcpy(r, of, sizeof of);
}

bool kmp_frame_turn(const double wxyz[4], double r[3][3])
{
    double length = 0;
    for (int k = 0; k < 4; k++)
        length = hypot(length, wxyz[k]);
    if (!(length > 0))
        return false;
    double w = wxyz[0] / length, x = wxyz[1] / length, y = wxyz[2] / length, z = wxyz[3] / length;
    const double of[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
                             {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
                             {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}};
    memcpy(r, of, sizeof of);
    tidy(r);
    return true;
}

bool kmp_frame_about(const double axis[3], double angle, double r[3][3])
{
    double length = hypot(hypot(axis[0], axis[1]), axis[2]);
    if (!(length > 0))
        return false;
    double s = without_rounding(sin(angle / 2)) / length;
    const double wxyz[4] = {without_rounding(cos(angle / 2)), s * axis[0], s * axis[1], s * axis[2]};
    return kmp_frame_turn(wxyz, r);
}

kmp_pose kmp_frame_none(void)
{
    return (kmp_pose){.r = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
}

void kmp_frame_vector(const kmp_pose *f, const double v[3], double out[3])
{
    double turned[3];
    for (int i = 0; i < 3; i++)
        turned[i] = f->r[i][0] * v[0] + f->r[i][1] * v[1] + f->r[i][2] * v[2];
    memcpy(out, turned, sizeof turned);
}

kmp_pose kmp_frame_in(const kmp_pose *outer, const kmp_pose *inner)
{
    kmp_pose f;
    kmp_frame_vector(outer, inner->p, f.p);
    for (int i = 0; i < 3; i++) {
        f.p[i] += outer->p[i];
        for (int j = 0; j < 3; j++)
            f.r[i][j] =
                outer->r[i][0] * inner->r[0][j] + outer->r[i][1] * inner->r[1][j] + outer->r[i][2] * inner->r[2][j];
    }
    tidy(f.r);
    return f;
}

kmp_pose kmp_frame_inverse(const kmp_pose *f)
{
    kmp_pose back = kmp_frame_none();
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            back.r[i][j] = f->r[j][i];
    kmp_frame_vector(&back, f->p, back.p);
    for (int i = 0; i < 3; i++)
        back.p[i] = 0 - back.p[i];
    return back;
}

bool kmp_frame_is_turned(const kmp_pose *f)
{
    return f->r[0][0] != 1 || f->r[1][1] != 1 || f->r[2][2] != 1;
}
