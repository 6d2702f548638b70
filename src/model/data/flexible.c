/* SPDX-License-Identifier: BSD-3-Clause */
/* The order of a flexible body's numbers in their block; what it is without deformation. */
#include "model/data/flexible.h"
#include "model/data/model.h"
#include "model/language/number_algebra.h"
#include <stddef.h>

const char *const kmp_stiffening_words[3] = {"none", "first", "full"};
const char *const kmp_flexible_frame_words[3] = {"clamped", "chord", "mean"};

/* The next `count` numbers of the block. */
static kmp_number *take(kmp_flexible *f, int count)
{
    kmp_number *next = f->numbers ? f->numbers + f->number_count : NULL;
    f->number_count += count;
    return next;
}

void kmp_flexible_lay(kmp_flexible *f, kmp_number *numbers)
{
    const int n = f->count, all = n + f->quadratic_count;
    f->numbers = numbers;
    f->number_count = 0;
    f->length = take(f, 1);
    f->mass = take(f, 1);
    f->moment = take(f, 3);
    f->second = take(f, 6);
    f->field = take(f, 3 * all);
    f->by_place = take(f, 9 * all);
    f->by_field = take(f, 9 * all * all);
    f->quadratic = take(f, f->quadratic_count * n * n);
    f->stiffness = take(f, n * n);
    f->damping = take(f, n * n);
    for (int k = 0; k < f->station_count; k++) {
        kmp_station *station = &f->stations[k];
        station->at = take(f, 3);
        station->shift = take(f, 3 * n);
        station->shift_more = take(f, 3 * n * n);
        station->turn = take(f, 3 * n);
        station->turn_more = take(f, 3 * n * n);
        station->section = take(f, 3);
        station->strained = take(f, 3 * n);
    }
}

bool kmp_flexible_joint_moves(const kmp_flexible *flexible)
{
    const kmp_station *station = &flexible->stations[0];
    const int n = flexible->count;
    bool moved = false;
    for (int k = 0; k < 3 * n && flexible->frame != KMP_FRAME_MEAN; k++)
        moved = moved || !kmp_number_is_nothing(station->shift[k]) || !kmp_number_is_nothing(station->turn[k]);
    for (int k = 0; k < 3 * n * n && flexible->frame != KMP_FRAME_MEAN; k++)
        moved =
            moved || !kmp_number_is_nothing(station->shift_more[k]) || !kmp_number_is_nothing(station->turn_more[k]);
    return moved;
}

void kmp_flexible_from_body(const kmp_flexible *f, const double v[3], double own[3])
{
    for (int k = 0; k < 3; k++)
        own[k] = f->turned ? f->axes[0][k] * v[0] + f->axes[1][k] * v[1] + f->axes[2][k] * v[2] : v[k];
}

void kmp_flexible_to_body(const kmp_flexible *f, const double own[3], double v[3])
{
    for (int k = 0; k < 3; k++)
        v[k] = f->turned ? f->axes[k][0] * own[0] + f->axes[k][1] * own[1] + f->axes[k][2] * own[2] : own[k];
}

/* Entry (i, j) of int X X' dm about the centre, in the axes of the body. */
static double spread(const kmp_flexible *f, double p[3][3], int i, int j)
{
    double sum = 0;
    if (!f->turned)
        return p[i][j];
    for (int k = 0; k < 3; k++)
        sum += f->axes[i][k] * (p[k][0] * f->axes[j][0] + p[k][1] * f->axes[j][1] + p[k][2] * f->axes[j][2]);
    return sum;
}

kmp_body kmp_body_undeformed(const kempe_model *model, int body)
{
    static const int row[6] = {0, 1, 2, 0, 0, 1}, column[6] = {0, 1, 2, 1, 2, 2};
    kmp_body rigid = model->bodies[body];
    if (rigid.flexible == 0)
        return rigid;
    const kmp_flexible *f = &model->flexibles[rigid.flexible - 1];
    const double mass = f->mass->value;
    double trace = 0, c[3], centre[3], about[3][3];
    rigid.mass = (kmp_number){.value = mass};
    for (int k = 0; k < 3; k++) {
        c[k] = f->moment[k].value / mass;
        trace += f->second[k].value - mass * c[k] * c[k];
    }
    for (int k = 0; k < 6; k++)
        about[row[k]][column[k]] = about[column[k]][row[k]] = f->second[k].value - mass * c[row[k]] * c[column[k]];
    kmp_flexible_to_body(f, c, centre);
    for (int k = 0; k < 3; k++)
        rigid.com[k] = (kmp_number){.value = centre[k]};
    for (int k = 0; k < 6; k++)
        rigid.inertia[k] = (kmp_number){.value = (k < 3 ? trace : 0) - spread(f, about, row[k], column[k])};
    return rigid;
}

const kmp_flexible *kmp_model_flexible(const kempe_model *model, int k)
{
    return &model->flexibles[k];
}

int kmp_model_flexible_count(const kempe_model *model)
{
    return model->flexible_count;
}
