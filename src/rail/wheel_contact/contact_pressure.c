/* SPDX-License-Identifier: BSD-3-Clause */
/* The pressures of a patch in a state that is found: the gap over the plane of the contact, then its contact under the
 * normal force of the patch, by strips, and from there on a grid. The equilibrium does not depend on it: normal force,
 * place and angle belong to the ellipse. */
#include "rail/wheel_contact/contact_pressure.h"
#include "base/memory.h"
#include "model/data/wheels.h"
#include "rail/wheel/patch.h"
#include "symbolic/table_function.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* -- the gap over the plane ------------------------------------------------------------------------------ */

/* The points of the wheel that can touch are on its trace (patch.c): at each the gap over the rail, which is
 * drawn along x, is least along x. In the axes of the plane, t across and n along its normal, both trace and rail are
 * curves n(t). For a curve with the parameter s
 *
 *     n'' = (n_ss t_s - t_ss n_s) / t_s^3.
 *
 * Around the trace the gap increases by the curvature of the wheel's circle, 1/r along its normal. Lateral places are
 * found strip by strip by Newton's method, from the place of the last one. */

/* Least inclination of a surface to the normal of the plane: a face that is steeper is not a function over it. */
#define STEEPEST 0.05

/* Newton's method from the neighbouring strip ends at this part of the wheel's radius. */
#define SETTLED 1e-12
enum { MOST_STEPS = 30 };

/* Values of the trace at s: x, y, z, r, r', and derivatives of y and z. */
enum { X, Y, Z, RADIUS, SLOPE, Y1, Z1, Y2, Z2, VALUES };

typedef struct wheel_gap {
    kmp_graph *g;
    kmp_ref value[VALUES];
    double *node; /* values of all nodes of the graph */
    const kmp_wheel *wheel;
    const kmp_table *rail;
    double out, up, cosine, sine;
    double low, high; /* of s */
    double s, origin; /* the point of reference, and its t */
} wheel_gap;

/* A place of both curves. */
typedef struct place {
    double s, y; /* on the wheel; of the rail, on the track */
    double t;
    double value[VALUES];
} place;

/* -- the wheel --------------------------------------------------------------------------------------------- */

static bool derive(wheel_gap *w, const kmp_track *track, const double *pose)
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

static void evaluate(const wheel_gap *w, place *p)
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
static bool find_wheel(const wheel_gap *w, double t, place *p)
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

static bool find_rail(const wheel_gap *w, double t, place *p)
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

static bool find(const wheel_gap *w, double t, place *p)
{
    return find_wheel(w, t, p) && find_rail(w, t, p);
}

static place begin(const wheel_gap *w)
{
    place p = {.s = w->s};
    evaluate(w, &p);
    p.y = p.value[Y];
    return p;
}

static void wheel_gap_free(wheel_gap *w)
{
    if (!w)
        return;
    kmp_graph_free(w->g);
    kmp_free(w->node);
    kmp_free(w);
}

/* A wheel whose pose has the KMP_POSE_SHOWN values of its output, in the zone of an elastic wheel, or anywhere on its
 * profile. The plane has a contact angle. Strips are counted from the wheel's point at s. NULL: no memory. */
static wheel_gap *wheel_gap_new(const kmp_wheel *wheel, const kmp_track *track, int zone, const double *pose,
                                double angle, double s)
{
    wheel_gap *w = kmp_calloc(1, sizeof *w);
    if (!w)
        return NULL;
    *w = (wheel_gap){.g = kmp_graph_new(),
                     .wheel = wheel,
                     .rail = track->rail,
                     .out = pose[0],
                     .up = pose[1],
                     .cosine = cos(angle),
                     .sine = sin(angle),
                     .s = s};
    if (!w->g || !derive(w, track, pose)) {
        wheel_gap_free(w);
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

/* -- the gap ------------------------------------------------------------------------------------------- */

/* The extent of the places, across, where both surfaces are functions over the plane: multiples of `step`, at most
 * `most` to either side. False: the point at s is not there. */
static bool wheel_gap_range(const wheel_gap *w, double step, int most, double *low, double *high)
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

static void fill(const wheel_gap *w, const place *p, int k, kmp_strip_gap *strips, double *y)
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

/* Fills in the strips: count, first and step are given, within the range, and arrays with room. Lateral places on the
 * track are in `y`, less the place of the point at s. False: a strip is not within the range. */
static bool wheel_gap_sample(const wheel_gap *w, kmp_strip_gap *strips, double *y)
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

/* Strips of the first pass, m for a wheel of 0.46 m, and at most this number to either side. */
#define COARSE 1e-4
enum { MOST_COARSE = 2000 };

/* The strips of the second pass cover the places with gaps up to this part of the approach of the first. */
#define REACH 1.8

/* Strips of the second pass; of these every fourth is in outlines. */
enum { FINE = 401, THINNED = 4, FINEST = 3 };

/* A grid: rectangles along the longest strip, rows across the narrowest lobe, and rows altogether
 * (bench/results/zones.txt has the effect of finer grids). Rolling takes a thousand times longer than pressing: its
 * grid is coarser. */
typedef struct fineness {
    int cells, lobe_rows, fewest_rows, most_rows;
} fineness;

static const fineness pressing_grid = {30, 14, 40, 140}, rolling_grid = {22, 9, 30, 90};

typedef struct zone {
    kmp_arena arena;
    wheel_gap *over;
    kmp_strip_gap gap;
    double *y; /* lateral places */
    kmp_strip *strip;
    kmp_normal_load_patch pressed;
    double modulus, normal;
    double low, high; /* the range of places */
    double narrowest; /* width of a lobe */
    kmp_strip_method method;
    int finer;
} zone;

/* -- options ----------------------------------------------------------------------------------------------- */

static const char *const words[] = {"none", "kik-piotrowski", "analyn", "half-space", NULL};

const char *kmp_pressure_word(kmp_pressure_method method)
{
    return method == KMP_PRESSURE_NONE ? NULL : words[method];
}

/* A word, or "half-space:2". */
static bool read_word(kempe_contacts *t, const char *text)
{
    size_t length = strcspn(text, ":");
    for (int k = 0; words[k]; k++)
        if (strlen(words[k]) == length && strncmp(words[k], text, length) == 0)
            t->pressure = (kmp_pressure_method)k;
    bool divided = t->pressure == KMP_PRESSURE_HALF_SPACE && text[length] && text[length + 1] >= '1' &&
                   text[length + 1] <= '0' + FINEST && !text[length + 2];
    t->finer = divided ? text[length + 1] - '0' : 1;
    return divided || (!text[length] && (t->pressure != KMP_PRESSURE_NONE || strcmp(text, words[0]) == 0));
}

kempe_status kmp_contact_pressure_request(kempe_contacts *t, const char *word)
{
    if (!word || read_word(t, word))
        return KEMPE_OK;
    return kmp_fail(t->given->context, KEMPE_E_ARGUMENT,
                    "--pressure: unknown method '%s'; available: none, kik-piotrowski, analyn, half-space, and "
                    "half-space:2 and half-space:3 with finer grids",
                    word);
}

/* -- passes -------------------------------------------------------------------------------------------- */

typedef enum answer { KNOWN, UNKNOWN, NO_MEMORY } answer;

/* Samples the gap in `count` strips from `first` on. */
static answer sample(zone *z, double first, double step, int count)
{
    z->gap = (kmp_strip_gap){.count = count, .first = first, .step = step};
    if (!KMP_ARENA_MAKE(&z->arena,
                        KMP_ROOM(double, count, &z->gap.gap, &z->gap.bend, &z->gap.centre, &z->gap.along, &z->y),
                        KMP_ROOM(kmp_strip, count, &z->strip)))
        return NO_MEMORY;
    return wheel_gap_sample(z->over, &z->gap, z->y) ? KNOWN : UNKNOWN;
}

static answer press(zone *z)
{
    bool known = kmp_strips_press(z->method, &z->gap, z->modulus, z->normal, &z->arena, z->strip, &z->pressed);
    return z->arena.failed ? NO_MEMORY : known ? KNOWN : UNKNOWN;
}

/* The width of the narrowest lobe. */
static double narrowest(const zone *z)
{
    int least = z->gap.count, length = 0;
    for (int k = 0; k < z->gap.count; k++) {
        length = z->strip[k].load > 0 ? length + 1 : 0;
        bool ends = length > 0 && (k + 1 == z->gap.count || !(z->strip[k + 1].load > 0));
        least = ends && length < least ? length : least;
    }
    return least * z->gap.step;
}

static answer by_strips(zone *z, double step)
{
    if (!wheel_gap_range(z->over, step, MOST_COARSE, &z->low, &z->high))
        return UNKNOWN;
    int count = (int)lround((z->high - z->low) / step) + 1;
    answer found = count < 3 ? UNKNOWN : sample(z, z->low, step, count);
    if (found == KNOWN)
        found = press(z);
    if (found != KNOWN)
        return found;
    /* The range of places whose gap is below REACH times the approach. */
    double most = REACH * z->pressed.approach, low = INFINITY, high = -INFINITY;
    for (int k = 0; k < z->gap.count; k++)
        if (z->gap.gap[k] < most) {
            low = fmin(low, z->gap.first + (k - 1) * z->gap.step);
            high = fmax(high, z->gap.first + (k + 1) * z->gap.step);
        }
    z->low = fmax(low, z->low);
    z->high = fmin(high, z->high);
    found = sample(z, z->low, (z->high - z->low) / (FINE - 1), FINE);
    if (found == KNOWN)
        found = press(z);
    if (found == KNOWN)
        z->narrowest = narrowest(z);
    return found;
}

static answer answer_of(kmp_half_space_result result)
{
    return result == KMP_HALF_SPACE_SOLVED ? KNOWN : result == KMP_HALF_SPACE_MEMORY ? NO_MEMORY : UNKNOWN;
}

static answer on_grid(zone *z, const fineness *grid, kmp_half_space *s)
{
    double range = z->high - z->low, step = fmin(z->narrowest / grid->lobe_rows, range / grid->fewest_rows);
    step = fmax(step, range / (grid->most_rows - 1)) / z->finer;
    int count = (int)floor(range / step) + 1;
    answer found = sample(z, (z->low + z->high - (count - 1) * step) / 2, step, count);
    if (found == KNOWN)
        found = press(z);
    if (found != KNOWN)
        return found;
    return answer_of(kmp_half_space_press(&z->gap, z->modulus, z->normal, grid->cells * z->finer, &z->arena, z->strip,
                                          &z->pressed, s));
}

/* Creep forces on a grid. Strips are counted outwards: on the right side lateral signs change. */
static answer roll(zone *z, const kmp_wheel *w, kempe_contact_patch *p)
{
    double left = w->side == KMP_TRACK_LEFT ? 1 : -1;
    kmp_half_space s;
    kempe_creep_force force;
    answer found = on_grid(z, &rolling_grid, &s);
    if (found != KNOWN)
        return found;
    const kmp_rolling rolling = {.shear_modulus = w->shear_modulus.value,
                                 .poisson = w->poisson,
                                 .friction = w->friction.value,
                                 .slip = {p->slip[0], left * p->slip[1]},
                                 .spin = left * p->spin,
                                 .origin = {begin(z->over).value[X], 0}};
    found = answer_of(kmp_half_space_roll(&z->gap, &s, &rolling, &z->arena, &force));
    if (found == KNOWN) {
        p->by_law[0] = force.force[0] + 0.0;
        p->by_law[1] = left * force.force[1] + 0.0; /* no negative zero */
    }
    return found;
}

/* -- the patch --------------------------------------------------------------------------------------------- */

static kempe_status take(kempe_contacts *t, const zone *z, answer found, kempe_contact_patch *p,
                         kmp_patch_outline *outline)
{
    if (found == NO_MEMORY)
        return kmp_fail_memory(t->given->context);
    if (found == UNKNOWN) {
        t->unknown_pressures++;
        return KEMPE_OK;
    }
    p->pressure = z->pressed.pressure;
    p->area = z->pressed.area;
    p->approach = z->pressed.approach;
    p->lobes = z->pressed.lobes;
    int every = t->pressure == KMP_PRESSURE_HALF_SPACE ? t->finer : THINNED;
    outline->strip = KMP_ARENA_NEW(&t->arena, kmp_outline_strip, z->gap.count / every + 1);
    KMP_TRY(kmp_made(t->given->context, outline->strip));
    int lobe = 0;
    for (int k = 0; k < z->gap.count; k++) {
        const kmp_strip *s = &z->strip[k];
        if (!(s->load > 0))
            continue;
        lobe += k == 0 || !(z->strip[k - 1].load > 0);
        if (k % every == 0)
            outline->strip[outline->count++] = (kmp_outline_strip){
                .lobe = lobe, .y = p->y + z->y[k], .from = s->from, .to = s->to, .pressure = s->pressure};
    }
    return KEMPE_OK;
}

kempe_status kmp_contact_pressure(kempe_contacts *t, int wheel, int number, const double *pose, kempe_contact_patch *p,
                                  kmp_patch_outline *outline)
{
    const kempe_model *model = t->system->model;
    const kmp_wheel *w = kmp_model_wheel(model, wheel);
    if (!p->touches)
        return KEMPE_OK;
    zone z = {.modulus = w->shear_modulus.value / (1 - w->poisson),
              .normal = p->normal,
              .finer = t->finer,
              .method = t->pressure == KMP_PRESSURE_KP ? KMP_STRIPS_KP : KMP_STRIPS_ANALYN};
    z.over = wheel_gap_new(w, kmp_model_track(model, w->track), number, pose, p->angle, p->s);
    answer found = z.over ? by_strips(&z, COARSE * w->scale) : NO_MEMORY;
    kmp_half_space solution;
    if (found == KNOWN && t->pressure == KMP_PRESSURE_HALF_SPACE)
        found = on_grid(&z, &pressing_grid, &solution);
    kempe_status status = take(t, &z, found, p, outline);
    if (status == KEMPE_OK && found == KNOWN && t->rolls)
        found = roll(&z, w, p);
    t->unknown_forces += t->rolls && found == UNKNOWN;
    if (found == NO_MEMORY)
        status = kmp_fail_memory(t->given->context);
    wheel_gap_free(z.over);
    kmp_arena_free(&z.arena);
    return status;
}
