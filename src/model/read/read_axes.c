/* SPDX-License-Identifier: BSD-3-Clause */
/* Axes and orientations: unit vectors, and frames from one or two of them. */
#include "model/read/read_axes.h"
#include "linalg/dense/dot.h"
#include "model/read/read_values.h"
#include "model/read/reading.h"
#include <math.h>

/* x, y, z with or without a minus. */
static bool read_letter_axis(const char *text, double axis[3])
{
    double sign = text[0] == '-' ? -1 : 1;
    const char *letter = text + (text[0] == '-');
    if (letter[0] < 'x' || letter[0] > 'z' || letter[1] != '\0')
        return false;
    axis[0] = axis[1] = axis[2] = 0;
    axis[letter[0] - 'x'] = sign;
    return true;
}

/* Scaled by the largest component first, so that no square overflows or vanishes. */
static bool normalise(double axis[3])
{
    double largest = fmax(fabs(axis[0]), fmax(fabs(axis[1]), fabs(axis[2])));
    if (!(largest > 0))
        return false;
    for (int i = 0; i < 3; i++)
        axis[i] /= largest;
    double length = sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
    for (int i = 0; i < 3; i++)
        axis[i] = axis[i] / length + 0.0; /* no negative zeros */
    return true;
}

bool kmp_read_axis(kmp_reader *r, const kmp_yaml *node, const char *what, double axis[3])
{
    kmp_number vector[3];
    if (node->kind != KMP_YAML_LIST) {
        if (node->kind == KMP_YAML_SCALAR && read_letter_axis(node->text, axis))
            return true;
        return kmp_reader_complain(r, node->place,
                                   "%s: an axis is x, y, z, -x, -y, -z or a list of three numbers%s%s%s", what,
                                   node->text[0] ? ", not '" : "", node->text, node->text[0] ? "'" : "");
    }
    if (!kmp_read_vector(r, node, kmp_reader_say(r, "%s: the axis", what), KMP_DIM_ANY, vector))
        return false;
    for (int i = 0; i < 3; i++) {
        axis[i] = vector[i].value;
        kmp_reader_fix(r, &vector[i]);
    }
    if (normalise(axis))
        return true;
    return kmp_reader_complain(r, node->place, "%s: the axis has no direction: all its components are zero", what);
}

/* -- orientations -------------------------------------------------------------------------------- */

static void set_column(double m[3][3], int k, const double v[3])
{
    for (int i = 0; i < 3; i++)
        m[i][k] = v[i] + 0.0;
}

/* An axis that is nearer to the opposite one than that, in rad, is turned there by half a turn about the next one. */
#define OPPOSITE 1e-9

void kmp_complete_axes(int k, const double axis[3], double m[3][3])
{
    int i = (k + 1) % 3, j = (k + 2) % 3;
    double across = axis[i] * axis[i] + axis[j] * axis[j], along = fabs(axis[k]), u[3], w[3];
    bool opposite = axis[k] < 0 && across < OPPOSITE * OPPOSITE;
    /* Rodrigues' rotation of unit vector k to the axis maps unit vector i to u = i - c axis_i (k + axis), c = 1 / (1 +
     * axis_k), here without a difference of nearly equal numbers. If `opposite`, it is the rotation of -k to the axis.
     */
    double c = axis[k] < 0 && !opposite ? (1 + along) / across : 1 / (1 + along);
    u[k] = opposite ? axis[i] : -axis[i];
    u[i] = 1 - c * axis[i] * axis[i];
    u[j] = -c * axis[i] * axis[j];
    kmp_cross3(axis, u, w);
    set_column(m, k, axis);
    set_column(m, i, u);
    set_column(m, j, w);
}

bool kmp_square_axes(int k, const double first[3], int l, const double second[3], double m[3][3])
{
    double along = kmp_dot3(first, second), v[3], w[3];
    for (int i = 0; i < 3; i++)
        v[i] = second[i] - along * first[i];
    double length = sqrt(kmp_dot3(v, v));
    if (k == l || !(length > 1e-6))
        return false;
    for (int i = 0; i < 3; i++)
        v[i] /= length;
    bool forward = l == (k + 1) % 3;
    kmp_cross3(forward ? first : v, forward ? v : first, w);
    set_column(m, k, first);
    set_column(m, l, v);
    set_column(m, 3 - k - l, w);
    return true;
}

static const kmp_key axes_keys[] = {{"x", "", ""}, {"y", "", ""}, {"z", "", ""}, {0}};

bool kmp_read_axes(kmp_reader *r, const kmp_yaml *node, const char *what, double m[3][3])
{
    double axis[2][3] = {{0}};
    int number[2] = {0};
    if (node->kind != KMP_YAML_MAP || node->count < 1 || node->count > 2)
        return kmp_reader_complain(r, node->place,
                                   "%s: axes are given by one or two of x, y, z, such as {z: [0, 1, 1]}", what);
    if (!kmp_read_map(r, node, what, axes_keys))
        return false;
    for (int k = 0; k < node->count; k++) {
        number[k] = node->keys[k]->text[0] - 'x';
        if (number[k] < 0 || number[k] > 2 || node->keys[k]->text[1] ||
            !kmp_read_axis(r, node->items[k], what, axis[k]))
            return false;
    }
    if (node->count == 1) {
        kmp_complete_axes(number[0], axis[0], m);
        return true;
    }
    if (kmp_square_axes(number[0], axis[0], number[1], axis[1], m))
        return true;
    return kmp_reader_complain(r, node->place, "%s: the two axes have the same direction", what);
}
