/* SPDX-License-Identifier: BSD-3-Clause */
/* Charts of spherical joints for simulators: the functions of kempe_charts in kempe_simulator.h. */
#include "constraints/evaluation/chart_joint.h"
#include "exchange/simulator/kempe_simulator.h"
#include <stddef.h>

static kmp_chart_joint joint_at(const kempe_charts *charts, int c)
{
    const double *axes = charts->axes + 9 * c;
    kmp_chart_joint j;
    j.a = axes;
    j.b = axes + 3;
    j.c = axes + 6;
    j.first = charts->first[c];
    j.before = charts->before[c] != 0;
    return j;
}

double kempe_chart_regular(const kempe_charts *charts, int c, const double *q)
{
    const kmp_chart_joint j = joint_at(charts, c);
    return kmp_chart_joint_regular(&j, q);
}

void kempe_chart_center(const kempe_charts *charts, int c, double *chart, double *q, double *qd)
{
    const kmp_chart_joint j = joint_at(charts, c);
    kmp_chart_joint_center(&j, chart, q, qd, NULL);
}

double kempe_chart_follow(const kempe_charts *charts, int c, const double *chart, const double *before,
                          const double *near, int sided, const double *q, double *angles)
{
    const kmp_chart_joint j = joint_at(charts, c);
    return kmp_chart_joint_follow(&j, chart, before, near, sided != 0, q, angles);
}

void kempe_chart_show(const kempe_charts *charts, int c, const double *chart, const double *near, double *q, double *qd,
                      double *qdd)
{
    const kmp_chart_joint j = joint_at(charts, c);
    (void)kmp_chart_joint_show(&j, chart, near, q, qd, qdd);
}

void kempe_chart_carry(const kempe_charts *charts, int c, const double *chart, const double *const inner[3],
                       const double *const shown[3], double *const changes[3])
{
    static const double one[KMP_CHART_SIZE] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    const kmp_chart_joint j = joint_at(charts, c);
    const kmp_chart_motion from = {chart, inner[0], inner[1], inner[2]}, to = {one, shown[0], shown[1], shown[2]};
    kmp_chart_joint_carry(&j, &from, &to, changes[0], changes[1], changes[2]);
}
