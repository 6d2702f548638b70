/* SPDX-License-Identifier: BSD-3-Clause */
/* Charts of spherical joints: the constant rotation C in addition to three angles, moved between them where the angles
 * come near their singular position. Angles and rates are converted by the exact rotation and its rate; the user's
 * angles are followed by continuity. */
#include "constraints/evaluation/charts.h"
#include "model/data/body.h"
#include <kempe/kempe.h>
#include <stdbool.h>
#include <string.h>

static kmp_chart_joint joint_of(const kempe_system *s, int c)
{
    const kmp_motion *m = kmp_model_motion(s->model, s->chart_first[c]);
    return (kmp_chart_joint){m[0].axis, m[1].axis, m[2].axis, s->chart_first[c], s->chart_before[c]};
}

static ptrdiff_t at(int c)
{
    return (ptrdiff_t)KMP_CHART_SIZE * c;
}

int kmp_charts_count(const kempe_system *system)
{
    return system->force ? 0 : system->chart_count;
}

void kmp_charts_reset(const kempe_system *system, double *chart)
{
    for (int k = 0; k < KMP_CHART_SIZE * system->chart_count; k++)
        chart[k] = k % KMP_CHART_SIZE % 4 == 0;
}

int kmp_chart_of(const kempe_system *system, int k)
{
    for (int c = 0; c < system->chart_count; c++)
        if (k >= system->chart_first[c] && k < system->chart_first[c] + 3)
            return c;
    return -1;
}

bool kmp_chart_is_own(const double *chart, int c)
{
    return kmp_chart_joint_is_own(chart + at(c));
}

bool kmp_charts_are_own(const kempe_system *system, const double *chart)
{
    for (int c = 0; c < kmp_charts_count(system); c++)
        if (!kmp_chart_is_own(chart, c))
            return false;
    return true;
}

double kmp_chart_regular(const kempe_system *system, int c, const double *q)
{
    const kmp_chart_joint j = joint_of(system, c);
    return kmp_chart_joint_regular(&j, q);
}

double kmp_chart_apart(const kempe_system *system, int c, const double *a, const double *b)
{
    const kmp_chart_joint j = joint_of(system, c);
    return kmp_chart_joint_apart(&j, a, b);
}

void kmp_chart_nearest(const kempe_system *system, int c, const double near[3], double angles[3])
{
    static const double own[KMP_CHART_SIZE] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    kmp_chart_joint j = joint_of(system, c);
    j.first = 0;
    (void)kmp_chart_joint_show(&j, own, near, angles, NULL, NULL);
}

void kmp_chart_center(const kempe_system *system, int c, double *chart, double *q, double *qd, double *qdd)
{
    const kmp_chart_joint j = joint_of(system, c);
    kmp_chart_joint_center(&j, chart + at(c), q, qd, qdd);
}

void kmp_chart_enter(const kempe_system *system, int c, const double *chart, const double angles[3],
                     const double rates[3], const double *q, double *qd)
{
    const kmp_chart_joint j = joint_of(system, c);
    kmp_chart_joint_enter(&j, chart + at(c), angles, rates, q, qd);
}

double kmp_chart_show(const kempe_system *system, int c, const double *chart, const double near[3], double *q,
                      double *qd, double *qdd)
{
    const kmp_chart_joint j = joint_of(system, c);
    return kmp_chart_joint_show(&j, chart + at(c), near, q, qd, qdd);
}

double kmp_chart_follow(const kempe_system *system, int c, const double *chart, const double *before,
                        const double near[3], bool sided, const double *q, double angles[3])
{
    const kmp_chart_joint j = joint_of(system, c);
    return kmp_chart_joint_follow(&j, chart + at(c), before, near, sided, q, angles);
}

void kmp_chart_carry(const kempe_system *system, int c, const kmp_chart_motion *from, const kmp_chart_motion *to,
                     double *dq, double *dqd, double *dqdd)
{
    const kmp_chart_joint j = joint_of(system, c);
    const kmp_chart_motion before = {from->chart + at(c), from->q, from->qd, from->qdd},
                           behind = {to->chart + at(c), to->q, to->qd, to->qdd};
    kmp_chart_joint_carry(&j, &before, &behind, dq, dqd, dqdd);
}

void kmp_charts_show(const kempe_system *system, const double *chart, const double *near, double *q, double *qd)
{
    for (int c = 0; c < kmp_charts_count(system); c++) {
        double from[3];
        memcpy(from, near + system->chart_first[c], sizeof from);
        if (!kmp_chart_is_own(chart, c))
            (void)kmp_chart_show(system, c, chart, from, q, qd, NULL);
    }
}
