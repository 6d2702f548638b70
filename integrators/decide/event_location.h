/* SPDX-License-Identifier: BSD-3-Clause */
/* The earliest change of conditions within a part of a step whose ends show that there is one: each condition is
 * narrowed to rounding, one after the other, to the earliest time so far (base/bracket.h). The search of runs, of lanes
 * and of generated simulators, which have this file too, for a site that evaluates the motion. */
#pragma once

#include "base/bracket.h"
#include "integrators/decide/conditions.h"

/** The motion and its conditions. A status is 0, or a number that ends the search. */
typedef struct kmp_location_site {
    void *self;
    int conditions;
    const int *kind;      /* of each condition: kmp_condition_kind */
    const double *mode;   /* the state that is fixed */
    const double *change; /* values of the conditions where the site is */
    /** Goes to a time within the step. */
    int (*look)(void *self, double t);
    /** The same for the value of one condition; the others may belong to another time. NULL: as `look`. */
    int (*look_for)(void *self, double t, int condition);
    /** Takes the value of a condition before its change. NULL: it is not wanted. */
    void (*before)(void *self, int condition, double value);
    /** A condition has been located between two times, at the second of which the site is. NULL: no matter. */
    int (*located)(void *self, int condition, double from, double to);
    /** The size of the place of a contact, for its sense, whose numbers follow by their roles; 0: another condition. */
    double (*size)(const void *self, int condition);
} kmp_location_site;

/** Halvings of the way back to a start behind which a condition has its fixed state; then the way falls faster. */
#define KMP_LOCATION_HALVINGS 8
#define KMP_LOCATION_FASTER   16
/** The least bracket about t = 0, as part of the way: with numbers that are all near to zero there, smaller ones would
 * end in times at which forces underflow. */
#define KMP_LOCATION_BRIEFEST (DBL_EPSILON * DBL_EPSILON)

static inline bool kmp_location_has_changed(const kmp_location_site *s, int k)
{
    return kmp_condition_differs((kmp_condition_kind)s->kind[k], s->mode[k], s->change[k]);
}

static inline int kmp_location_look_for(const kmp_location_site *s, double t, int k)
{
    return s->look_for ? s->look_for(s->self, t, k) : s->look(s->self, t);
}

/* The bracket that is narrow enough: rounding of the time, not below the `briefest` time, or of a distance. The
 * distance of surfaces that meet slowly is rounding for a longer time, within which kmp_location_surface finds the
 * place. */
static inline double kmp_location_tolerance(const kmp_bracket *b, double rounding, double briefest)
{
    const double of_time = fmax(4 * DBL_EPSILON * fmax(fabs(b->near), fabs(b->far)), briefest);
    const double slope = fabs((b->f_far - b->f_near) / (b->far - b->near));
    return rounding > 0 && slope > 0 ? fmax(of_time, rounding / slope) : of_time;
}

/* The cubic of a distance between two times, by its values and rates there: c[0] + c[1] s + c[2] s^2 + c[3] s^3, s the
 * part of the way. */
typedef struct kmp_location_cubic {
    double from, way, c[4];
} kmp_location_cubic;

static inline kmp_location_cubic kmp_location_cubic_of(double from, double f, double rate, double to, double f_to,
                                                       double rate_to)
{
    const double way = to - from, u = way * rate, v = way * rate_to;
    return (kmp_location_cubic){from, way, {f, u, 3 * (f_to - f) - 2 * u - v, 2 * (f - f_to) + u + v}};
}

static inline double kmp_location_slope(const kmp_location_cubic *p, double s)
{
    return p->c[1] + s * (2 * p->c[2] + 3 * s * p->c[3]);
}

/* The zero that Newton's method finds from the end on: a fall that ends there has its last one. */
static inline double kmp_location_zero(const kmp_location_cubic *p)
{
    enum { MOST = 8 };
    double s = 1;
    for (int i = 0; i < MOST; i++)
        s -= (p->c[0] + s * (p->c[1] + s * (p->c[2] + s * p->c[3]))) / kmp_location_slope(p, s);
    return p->from + s * p->way;
}

/* The first two points for a distance: the zero of its cubic, and a place on the other side of the zero that its value
 * there and the slope of the cubic give. *x: the point that the bracket would take. */
static inline void kmp_location_foresee(const kmp_bracket *b, const kmp_location_cubic *p, double tolerance, double *x)
{
    double point = NAN;
    if (b->points == 0) {
        point = kmp_location_zero(p);
    } else if (b->points == 1) {
        const double last = b->last_is_far ? b->far : b->near, f = b->last_is_far ? b->f_far : b->f_near;
        const double slope = kmp_location_slope(p, (last - p->from) / p->way) / p->way;
        point = last - f / slope + (b->last_is_far ? -0.5 : 0.5) * tolerance;
    }
    if (point > b->near + 0.5 * tolerance && point < b->far - 0.5 * tolerance)
        *x = point;
}

/* Narrows (from, *high], at whose end condition k has changed, to rounding; `at_from` are the values at `from`. First
 * finds a point from there on where it has its fixed state: after a start just behind an event rounding decides. If
 * there is none, it changes at once. The site is left at *high. */
static inline int kmp_location_narrow(const kmp_location_site *s, int k, double from, const double *at_from,
                                      double *high)
{
    const double f_high = s->change[k], size = s->size(s->self, k), rounding = DBL_EPSILON * size;
    const int rate = KMP_ROLE_RATE - KMP_ROLE_SENSE;
    double f_low = at_from[k], width = *high - from, least = 4 * DBL_EPSILON * fmax(fabs(from), width), near = from;
    double x = NAN;
    kmp_location_cubic cubic = {.way = 0};
    if (size > 0)
        cubic = kmp_location_cubic_of(from, f_low, at_from[k + rate], *high, f_high, s->change[k + rate]);
    int status = 0;
    bool found = !kmp_condition_differs((kmp_condition_kind)s->kind[k], s->mode[k], f_low);
    for (int i = 0; status == 0 && !found && width > least; i++) {
        width /= i < KMP_LOCATION_HALVINGS ? 2 : KMP_LOCATION_FASTER;
        near = from + width;
        status = kmp_location_look_for(s, near, k);
        f_low = s->change[k];
        found = !kmp_location_has_changed(s, k);
    }
    kmp_bracket bracket = kmp_bracket_of(found ? near : from, f_low, found ? *high : from, f_high);
    const double briefest = KMP_LOCATION_BRIEFEST * (*high - from);
    while (status == 0 && kmp_bracket_next(&bracket, kmp_location_tolerance(&bracket, rounding, briefest), &x)) {
        if (size > 0 && found)
            kmp_location_foresee(&bracket, &cubic, kmp_location_tolerance(&bracket, rounding, briefest), &x);
        status = kmp_location_look_for(s, x, k);
        const bool beyond = kmp_location_has_changed(s, k);
        kmp_bracket_take(&bracket, x, s->change[k], beyond);
        if (status == 0 && !beyond && s->before)
            s->before(s->self, k, s->change[k]);
    }
    *high = bracket.far;
    const bool is_there = *high == x && !s->look_for;
    return status != 0 || is_there ? status : s->look(s->self, *high);
}

/** Finds the earliest change in (from, *t], with the values of the conditions at `from`; the site is at *t. It is
 * left where it is found. */
static inline int kmp_location_earliest(const kmp_location_site *s, double from, const double *at_from, double *t)
{
    int status = 0;
    for (int k = 0; status == 0 && *t > from && k < s->conditions; k++) {
        if (!kmp_location_has_changed(s, k))
            continue;
        status = kmp_location_narrow(s, k, from, at_from, t);
        if (status == 0 && s->located)
            status = s->located(s->self, k, from, *t);
    }
    return status;
}

/** A contact is located behind its surface, by the overlap that counts as none where it opens. Each flight would end
 * lower than it begins by this height, and strike faster. If only contacts have changed, goes back from *t to the last
 * place where they touch. A contact that has not been apart since `from` stays. The site is left at *t. */
static inline int kmp_location_surface(const kmp_location_site *s, double from, double *t)
{
    const int place = KMP_ROLE_PLACE - KMP_ROLE_SENSE, rate = KMP_ROLE_RATE - KMP_ROLE_SENSE;
    double back = INFINITY;
    int which = -1;
    for (int k = 0; k < s->conditions; k++) {
        if (!kmp_location_has_changed(s, k))
            continue;
        /* The time since the surfaces have met; 0: they have not. */
        const bool deep = s->size(s->self, k) > 0 && s->change[k + place] < 0 && s->change[k + rate] < 0;
        const double since = deep ? s->change[k + place] / s->change[k + rate] : 0;
        which = since < back ? k : which;
        back = fmin(back, since);
    }
    const double surface = *t - back;
    if (which < 0 || !(surface > from && surface < *t))
        return 0;
    const double gap = s->change[which + place];
    const int status = s->look(s->self, surface);
    if (status != 0)
        return status;
    if (fabs(s->change[which + place]) > fabs(gap) / 2)
        return s->look(s->self, *t);
    *t = surface;
    return 0;
}
