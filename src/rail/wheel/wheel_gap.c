/* SPDX-License-Identifier: BSD-3-Clause */
/* The points of the wheel that can touch are those of its trace (pair.c): at each the gap over the rail, which is drawn
 * along x, is least along x. In the axes of the plane, t across and n along its normal, both trace and rail are curves
 * n(t). For a curve with the parameter s
 *
 *     n'' = (n_ss t_s - t_ss n_s) / t_s^3.
 *
 * Around the trace the gap increases by the curvature of the wheel's circle, 1/r along its normal. Lateral places are
 * found strip by strip by Newton's method, from that of the last one. */
#include "rail/wheel/wheel_gap.h"
#include "base/memory.h"
#include "rail/wheel/pair.h"
#include "symbolic/table_function.h"
#include <math.h>
#include <stdlib.h>

/* Least inclination of a surface to the normal of the plane: a face that is steeper is no function over it. */
#define STEEPEST 0.05

/* Newton's method from the neighbouring strip ends at this part of the wheel's radius. */
#define SETTLED 1e-12
enum { MOST_STEPS = 30 };

/* Values of the trace at s: x, y, z, r, r', and derivatives of y and z. */
enum { X, Y, Z, RADIUS, SLOPE, Y1, Z1, Y2, Z2, VALUES };

struct kmp_wheel_gap {
    kmp_graph *g;
    kmp_ref value[VALUES];
    double *node; /* values of all nodes of the graph */
    const kmp_wheel *wheel;
    const kmp_table *rail;
    double out, up, cosine, sine;
    double low, high; /* of s */
    double s, origin; /* the point of reference, and its t */
};

/* A place of both curves. */
typedef struct place {
    double s, y; /* on the wheel; of the rail, on the track */
    double t;
    double value[VALUES];
} place;

/* -- the wheel --------------------------------------------------------------------------------------------- */

static bool derive(kmp_wheel_gap *w, const kmp_track *track, const double *pose)
{
    kmp_graph *g = w->g;
    kmp_wheel_pair p = {.g = g, .radius = kmp_const(g, w->wheel->radius.value), .out = kmp_const(g, pose[0])};
    for (int k = 0; k < 3; k++)
        p.axle[k] = kmp_const(g, pose[2 + k]);
    p.wheel = kmp_graph_add_table(g, w->wheel->profile->height);
    p.rail = kmp_graph_add_table(g, track->rail);
    kmp_ref s = kmp_input(g, KMP_IN_Q, 0);
    kmp_trace t = kmp_trace_at(&p, s);
    const kmp_ref value[] = {t.x, t.y, t.z, t.radius, t.slope, kmp_slope_of(g, t.y, s), kmp_slope_of(g, t.z, s)};
    for (int k = 0; k < Y2; k++)
        w->value[k] = value[k];
    w->value[Y2] = kmp_slope_of(g, value[Y1], s);
    w->value[Z2] = kmp_slope_of(g, value[Z1], s);
    w->node = kmp_calloc((size_t)kmp_graph_count(g), sizeof *w->node);
    return w->node && !kmp_graph_failed(g);
}

static void evaluate(const kmp_wheel_gap *w, place *p)
{
    const double *inputs[KMP_IN_COUNT] = {NULL};
    inputs[KMP_IN_Q] = &p->s;
    kmp_graph_eval(w->g, inputs, w->node);
    for (int k = 0; k < VALUES; k++) {
        double value = w->node[kmp_id(w->value[k])];
        p->value[k] = kmp_is_negative(w->value[k]) ? -value : value;
    }
    p->value[Y] += w->out;
    p->value[Z] += w->up;
    p->t = w->cosine * p->value[Y] + w->sine * p->value[Z];
}

/* The wheel's point over t, from one nearby. */
static bool find_wheel(const kmp_wheel_gap *w, double t, place *p)
{
    for (int k = 0; k < MOST_STEPS; k++) {
        evaluate(w, p);
        double slope = w->cosine * p->value[Y1] + w->sine * p->value[Z1], miss = t - p->t;
        if (!(slope > STEEPEST))
            return false;
        if (fabs(miss) <= SETTLED * w->wheel->radius.value)
            return p->s >= w->low && p->s <= w->high;
        p->s += miss / slope;
    }
    return p->s >= w->low && p->s <= w->high;
}

static bool find_rail(const kmp_wheel_gap *w, double t, place *p)
{
    const kmp_table *rail = w->rail;
    for (int k = 0; k < MOST_STEPS; k++) {
        double slope = w->cosine + w->sine * kmp_table_value(rail, 1, p->y);
        double miss = t - w->cosine * p->y - w->sine * kmp_table_value(rail, 0, p->y);
        if (!(slope > STEEPEST))
            return false;
        if (fabs(miss) <= SETTLED * w->wheel->radius.value)
            break;
        p->y += miss / slope;
    }
    return p->y >= rail->x[0] && p->y <= rail->x[rail->count - 1];
}

static bool find(const kmp_wheel_gap *w, double t, place *p)
{
    return find_wheel(w, t, p) && find_rail(w, t, p);
}

static place begin(const kmp_wheel_gap *w)
{
    place p = {.s = w->s};
    evaluate(w, &p);
    p.y = p.value[Y];
    return p;
}

kmp_wheel_gap *kmp_wheel_gap_new(const kmp_wheel *wheel, const kmp_track *track, int zone, const double *pose,
                                 double angle, double s)
{
    kmp_wheel_gap *w = kmp_calloc(1, sizeof *w);
    if (!w)
        return NULL;
    *w = (kmp_wheel_gap){.g = kmp_graph_new(),
                         .wheel = wheel,
                         .rail = track->rail,
                         .out = pose[0],
                         .up = pose[1],
                         .cosine = cos(angle),
                         .sine = sin(angle),
                         .s = s};
    if (!w->g || !derive(w, track, pose)) {
        kmp_wheel_gap_free(w);
        return NULL;
    }
    /* The limits of an elastic wheel's zone, or of the profile. */
    const kmp_table *height = w->wheel->profile->height;
    double border = kmp_zone_border(w->wheel);
    bool elastic = w->wheel->form == KMP_CONTACT_ELASTIC;
    w->low = fmax(height->x[0], elastic ? w->wheel->zone[zone][0] - border : -INFINITY);
    w->high = fmin(height->x[height->count - 1], elastic ? w->wheel->zone[zone][1] + border : INFINITY);
    w->origin = begin(w).t;
    return w;
}

void kmp_wheel_gap_free(kmp_wheel_gap *w)
{
    if (!w)
        return;
    kmp_graph_free(w->g);
    kmp_free(w->node);
    kmp_free(w);
}

double kmp_wheel_gap_centre(const kmp_wheel_gap *w)
{
    return begin(w).value[X];
}

/* -- the gap ------------------------------------------------------------------------------------------- */

bool kmp_wheel_gap_range(const kmp_wheel_gap *w, double step, int most, double *low, double *high)
{
    place p = begin(w);
    if (!find(w, w->origin, &p))
        return false;
    int reached[2] = {0, 0};
    for (int side = 0; side < 2; side++) {
        place at = p;
        while (reached[side] < most && find(w, w->origin + (side ? step : -step) * (reached[side] + 1), &at))
            reached[side]++;
    }
    *low = -step * reached[0];
    *high = step * reached[1];
    return true;
}

static void fill(const kmp_wheel_gap *w, const place *p, int k, kmp_strip_gap *strips, double *y)
{
    const double *v = p->value;
    double c = w->cosine, sine = w->sine, height = kmp_table_value(w->rail, 0, p->y);
    double t1 = c * v[Y1] + sine * v[Z1], n1 = c * v[Z1] - sine * v[Y1];
    double t2 = c * v[Y2] + sine * v[Z2], n2 = c * v[Z2] - sine * v[Y2];
    double under = c + sine * kmp_table_value(w->rail, 1, p->y);
    strips->gap[k] = c * (v[Z] - height) - sine * (v[Y] - p->y);
    strips->bend[k] =
        (n2 * t1 - t2 * n1) / (t1 * t1 * t1) - kmp_table_value(w->rail, 2, p->y) / (under * under * under);
    strips->centre[k] = v[X];
    strips->along[k] = 1 / (v[RADIUS] * sqrt(1 + v[SLOPE] * v[SLOPE]));
    y[k] = v[Y];
}

bool kmp_wheel_gap_sample(const kmp_wheel_gap *w, kmp_strip_gap *strips, double *y)
{
    place p = begin(w);
    double least = INFINITY, at = p.value[Y];
    /* from the strip next to the point of reference to both sides */
    int middle = (int)fmin(fmax(round(-strips->first / strips->step), 0), strips->count - 1);
    for (int side = 0; side < 2; side++) {
        place there = p;
        for (int k = side ? middle : middle - 1; side ? k < strips->count : k >= 0; k += side ? 1 : -1) {
            if (!find(w, w->origin + strips->first + k * strips->step, &there))
                return false;
            fill(w, &there, k, strips, y);
            least = fmin(least, strips->gap[k]);
        }
    }
    for (int k = 0; k < strips->count; k++) {
        strips->gap[k] -= least;
        y[k] -= at;
    }
    return true;
}
