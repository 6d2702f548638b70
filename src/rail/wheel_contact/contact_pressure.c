/* SPDX-License-Identifier: BSD-3-Clause */
/* The pressures of a patch in a state that is found: the gap over the plane of the contact, then its contact under the
 * normal force of the patch, by strips, and from that on a grid. The equilibrium does not depend on it: normal force,
 * place and angle are those of the ellipse. */
#include "rail/wheel_contact/contact_pressure.h"
#include "model/data/model.h"
#include "rail/contact/half_space.h"
#include "rail/contact/strips.h"
#include "rail/wheel/wheel_gap.h"
#include "rail/wheel_contact/contact_sweep.h"
#include <math.h>
#include <string.h>

/* Strips of the first pass, m for a wheel of 0.46 m, and at most so many to either side. */
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
    kmp_wheel_gap *over;
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
    return kmp_wheel_gap_sample(z->over, &z->gap, z->y) ? KNOWN : UNKNOWN;
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
    if (!kmp_wheel_gap_range(z->over, step, MOST_COARSE, &z->low, &z->high))
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
                                 .origin = {kmp_wheel_gap_centre(z->over), 0}};
    found = answer_of(kmp_half_space_roll(&z->gap, &s, &rolling, &z->arena, &force));
    if (found == KNOWN) {
        p->by_law[0] = force.force[0] + 0.0;
        p->by_law[1] = left * force.force[1] + 0.0; /* no negative zero */
    }
    return found;
}

/* -- the patch --------------------------------------------------------------------------------------------- */

static kempe_status take_outline(kempe_contacts *t, const zone *z, double y, int every, kmp_outline *outline)
{
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
                .lobe = lobe, .y = y + z->y[k], .from = s->from, .to = s->to, .pressure = s->pressure};
    }
    return KEMPE_OK;
}

static kempe_status take(kempe_contacts *t, const zone *z, answer found, kempe_contact_patch *p, kmp_outline *outline)
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
    return take_outline(t, z, p->y, t->pressure == KMP_PRESSURE_HALF_SPACE ? t->finer : THINNED, outline);
}

kempe_status kmp_contact_pressure(kempe_contacts *t, int wheel, int number, const double *pose, kempe_contact_patch *p,
                                  kmp_outline *outline)
{
    const kempe_model *model = t->system->model;
    const kmp_wheel *w = &model->wheels[wheel];
    if (!p->touches)
        return KEMPE_OK;
    zone z = {.modulus = w->shear_modulus.value / (1 - w->poisson),
              .normal = p->normal,
              .finer = t->finer,
              .method = t->pressure == KMP_PRESSURE_KP ? KMP_STRIPS_KP : KMP_STRIPS_ANALYN};
    z.over = kmp_wheel_gap_new(w, &model->tracks[w->track], number, pose, p->angle, p->s);
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
    kmp_wheel_gap_free(z.over);
    kmp_arena_free(&z.arena);
    return status;
}
