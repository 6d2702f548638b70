/* SPDX-License-Identifier: BSD-3-Clause */
/* The mappings under `flexible`. Its numbers are numbers of the model; which of them are wanted follows from the
 * shapes. */
#include "model/read/read_flexible.h"
#include "model/data/model.h"
#include "model/flexible/beam.h"
#include "model/language/expression_value.h"
#include "model/language/number_algebra.h"
#include "model/read/read_bodies.h"
#include "model/read/read_modal_body.h"
#include "model/read/read_values.h"
#include <math.h>
#include <string.h>

static const kmp_key flexible_keys[] = {
#include "model/keys/flexible_keys.def"
    {0}};
static const kmp_key beam_keys[] = {
#include "model/keys/beam_keys.def"
    {0}};
static const kmp_key taper_keys[] = {
#include "model/keys/taper_keys.def"
    {0}};
static const kmp_key section_keys[] = {
#include "model/keys/section_keys.def"
    {0}};
static const kmp_key section_number_keys[] = {
#include "model/keys/section_number_keys.def"
    {0}};
static const kmp_key shape_keys[] = {
#include "model/keys/beam_shape_keys.def"
    {0}};
static const kmp_key damping_keys[] = {
#include "model/keys/damping_keys.def"
    {0}};

/* A flexible body while it is read. */
typedef struct kmp_flexible_reading {
    kmp_reader *r;
    const char *body;        /* "body 'rod'" */
    kmp_beam beam;           /* of a body from a file its frame and damping */
    bool of_file;            /* not a beam */
    kmp_modal_reading *file; /* NULL: a beam, or errors */
    bool rotary, wrong;
    kmp_number *stations;
    int station_count;
} entry;

static const char *const families[KMP_BEAM_FAMILIES] = {"y", "z", "torsion", "axial"};

/* -- pieces ------------------------------------------------------------------------------------------ */

static const char *say(const entry *e, const char *key)
{
    return kmp_reader_say(e->r, "%s of the beam of %s", key, e->body);
}

/* Of an error that has been reported. */
static bool fail(entry *e)
{
    e->wrong = true;
    return false;
}

#define COMPLAIN(e, at, ...) (kmp_reader_complain((e)->r, (at)->place, __VA_ARGS__), fail(e))

/* The mapping of a part of the body: "the PART of body 'rod'". */
static bool read_map(entry *e, const kmp_yaml *map, const char *part, const kmp_key *keys)
{
    return kmp_read_map(e->r, map, kmp_reader_say(e->r, "%s of %s", part, e->body), keys) || fail(e);
}

/* A number without a separate name: the constants that it is a part of have none. */
static bool read_unnamed(entry *e, const kmp_yaml *node, const char *what, kmp_field_rule rule, kmp_dimension unit,
                         kmp_number *number)
{
    if (!kmp_read_ruled(e->r, node, what, unit, rule, number))
        return fail(e);
    number->symbol = 0;
    return true;
}

/* A key of a mapping that is wanted for a reason, which says what has or needs it; "": it may be absent. */
static bool read_wanted(entry *e, const kmp_yaml *map, const kmp_key *keys, const char *key, const char *reason,
                        kmp_number *number)
{
    const kmp_yaml *node = kmp_yaml_get(map, key);
    if (node)
        return read_unnamed(e, node, say(e, key), KMP_FIELD_POSITIVE, kmp_key_dimension(keys, key), number);
    if (!reason[0])
        return false;
    return COMPLAIN(e, map, "the beam of %s has no key '%s': %s", e->body, key, reason);
}

/* A number, or two of a list. */
static bool read_two(entry *e, const kmp_yaml *map, const char *key, const char *reason, kmp_number two[2])
{
    const kmp_yaml *node = kmp_yaml_get(map, key);
    if (!node || node->kind != KMP_YAML_LIST) {
        const bool good = read_wanted(e, map, beam_keys, key, reason, &two[0]);
        two[1] = two[0];
        return good;
    }
    bool good = kmp_read_list(e->r, node, say(e, key), 2);
    for (int k = 0; k < 2 && good; k++)
        good = read_unnamed(e, node->items[k], say(e, key), KMP_FIELD_POSITIVE, kmp_key_dimension(beam_keys, key),
                            &two[k]);
    return good || fail(e);
}

static int read_word(entry *e, const kmp_yaml *map, const char *key, kmp_name_list words, int absent)
{
    const char *what = kmp_reader_say(e->r, "%s of %s", key, e->body);
    int found = kmp_read_choice_of(e->r, map, key, what, words, "the word is", absent);
    if (found < 0)
        fail(e);
    return found < 0 ? absent : found;
}

/* yes or no; `absent` without the key. */
static bool read_flag(entry *e, const kmp_yaml *map, const char *key, bool absent)
{
    const char *what = kmp_reader_say(e->r, "%s of %s", key, e->body);
    int found = kmp_read_choice_of(e->r, map, key, what, kmp_no_or_yes, "the word is", absent);
    return found < 0 ? fail(e) : found;
}

static bool has(const entry *e, int family)
{
    return e->beam.count[family] > 0;
}

/* True if x is a part of the length that does not depend on parameters: x/length for others of them. */
static bool is_fixed_part(const entry *e, kmp_number x)
{
    const kempe_model *model = e->r->model;
    const double nominal = x.value / e->beam.length.value, rounding = 1e-12;
    if (!x.expr && !e->beam.length.expr)
        return true;
    double *other = KMP_ARENA_NEW(&e->r->scratch, double, model->parameter_count);
    for (int k = 0; other && k < model->parameter_count; k++)
        other[k] = model->parameters[k].number.value * (1 + 0.1 / (k + 1.7)) + 1e-3 / (k + 2.3);
    const double part =
        other ? (x.expr ? kmp_expr_value(x.expr, other) : x.value) /
                    (e->beam.length.expr ? kmp_expr_value(e->beam.length.expr, other) : e->beam.length.value)
              : NAN;
    return fabs(part - nominal) <= rounding;
}

/* With stations a taper has all sections of the beam. */
static bool has_stations(const kmp_yaml *taper)
{
    return kmp_yaml_get(taper, "at") || kmp_yaml_get(taper, "section");
}

/* -- cross-sections ---------------------------------------------------------------------------------- */

typedef struct section {
    kmp_taper area, about[2], twist; /* about: int y^2, int z^2 */
    kmp_number shear[2];             /* parts of the area, where it is the same everywhere */
    kmp_taper edge[2];               /* along y and z; where it is round, its diameter */
    bool round;
} section;

static kmp_number number(double value)
{
    return (kmp_number){.value = value};
}

static kmp_number times(const entry *e, kmp_number a, kmp_number b)
{
    return kmp_number_times(&e->r->model->arena, a, b);
}

static kmp_number scale(const entry *e, double factor, kmp_number a)
{
    return kmp_number_scale(&e->r->model->arena, factor, a);
}

static kmp_number plus(const entry *e, kmp_number a, kmp_number b)
{
    return kmp_number_add(&e->r->model->arena, a, b);
}

static kmp_number over(const entry *e, kmp_number a, kmp_number b)
{
    return kmp_number_over(&e->r->model->arena, a, b);
}

static kmp_taper product(const entry *e, const kmp_taper *a, const kmp_taper *b)
{
    return kmp_taper_times(&e->r->model->arena, a, b);
}

static kmp_taper multiple(const entry *e, kmp_number factor, const kmp_taper *a)
{
    return kmp_taper_scale(&e->r->model->arena, factor, a);
}

/* factor (a - b) */
static kmp_taper difference(const entry *e, double factor, const kmp_taper *a, const kmp_taper *b)
{
    const kmp_taper less = multiple(e, number(-1), b), sum = kmp_taper_add(&e->r->model->arena, a, &less);
    return multiple(e, number(factor), &sum);
}

/* St. Venant's torsion of a rectangle (Timoshenko and Goodier 1970, section 109), edges a and b: a b^3 (1/3 - 64
 * b/(pi^5 a) sum of tanh(n pi a/2b)/n^5 over odd n). The sum is the sum of 1/n^5, 31/32 zeta(5), less a few terms,
 * which decrease by exp(-pi a/b) where b is the shorter edge. */
static kmp_number twist_of_rectangle(const entry *e, kmp_number a, kmp_number b)
{
    const double pi = 3.14159265358979323846, whole = 1.00452376279513961613;
    const kmp_number longer = a.value >= b.value ? a : b, shorter = a.value >= b.value ? b : a;
    const kmp_number ratio = over(e, longer, shorter);
    kmp_number sum = number(whole);
    for (int n = 1; n <= 7; n += 2) {
        const kmp_number bow = kmp_number_tanh(&e->r->model->arena, scale(e, n * pi / 2, ratio));
        const double by = 1 / pow(n, 5);
        sum = plus(e, sum, plus(e, number(-by), scale(e, by, bow)));
    }
    const kmp_number less = over(e, scale(e, -64 / pow(pi, 5), sum), ratio);
    const kmp_number cube = times(e, shorter, times(e, shorter, shorter));
    return times(e, times(e, longer, cube), plus(e, number(1 / 3.0), less));
}

/* The edges of a rectangle along the beam. */
typedef struct rectangle {
    const entry *e;
    kmp_taper edge[2];
} rectangle;

static kmp_number twist_at(const void *user, double xi)
{
    const rectangle *r = user;
    kmp_number edge[2];
    for (int k = 0; k < 2; k++)
        edge[k] = kmp_taper_at(&r->e->r->model->arena, &r->edge[k], number(xi));
    return twist_of_rectangle(r->e, edge[0], edge[1]);
}

/* Parts of the area that carry shear: Cowper 1966. */
static void take_rectangle(const entry *e, const kmp_taper edge[2], kmp_number poisson, section *s)
{
    const rectangle both = {e, {edge[0], edge[1]}};
    s->edge[0] = edge[0];
    s->edge[1] = edge[1];
    s->area = product(e, &edge[0], &edge[1]);
    for (int k = 0; k < 2; k++) {
        const kmp_taper square = product(e, &edge[k], &edge[k]), fourth = product(e, &s->area, &square);
        s->about[k] = multiple(e, number(1 / 12.0), &fourth);
    }
    if (!kmp_taper_varies(&edge[0]) && !kmp_taper_varies(&edge[1]))
        s->twist = kmp_taper_constant(twist_of_rectangle(e, edge[0].c[0], edge[1].c[0]));
    else if (has(e, KMP_BEAM_TORSION))
        s->twist =
            kmp_taper_fit(&e->r->model->arena, both.edge[0].next ? &both.edge[0] : &both.edge[1], twist_at, &both);
    s->shear[0] = s->shear[1] =
        over(e, plus(e, number(10), scale(e, 10, poisson)), plus(e, number(12), scale(e, 11, poisson)));
}

/* The part of a ring's area that carries shear, by its diameters. */
static kmp_number shear_of_ring(const entry *e, kmp_number outer, kmp_number inner, kmp_number poisson)
{
    const kmp_number ratio = over(e, inner, outer), part = times(e, ratio, ratio), sum = plus(e, number(1), part);
    const kmp_number whole = times(e, sum, sum);
    const kmp_number up = scale(e, 6, times(e, whole, plus(e, number(1), poisson)));
    const kmp_number down = plus(e, times(e, whole, plus(e, number(7), scale(e, 6, poisson))),
                                 times(e, part, plus(e, number(20), scale(e, 12, poisson))));
    return over(e, up, down);
}

/* A ring of two diameters, the outer one first; inner 0: a disc. */
static void take_ring(const entry *e, const kmp_taper diameter[2], kmp_number poisson, section *s)
{
    const double pi = 3.14159265358979323846;
    kmp_taper square[2], fourth[2];
    for (int k = 0; k < 2; k++) {
        square[k] = product(e, &diameter[k], &diameter[k]);
        fourth[k] = product(e, &square[k], &square[k]);
    }
    s->edge[0] = s->edge[1] = diameter[0];
    s->round = true;
    s->area = difference(e, pi / 4, &square[0], &square[1]);
    s->about[0] = s->about[1] = difference(e, pi / 64, &fourth[0], &fourth[1]);
    s->twist = multiple(e, number(2), &s->about[0]);
    s->shear[0] = s->shear[1] = shear_of_ring(e, diameter[0].c[0], diameter[1].c[0], poisson);
}

/* The dimensions of a section under its kind; sizes at the end of a taper may be zero. */
static bool read_dimensions(entry *e, const kmp_yaml *node, const char *kind, bool tapers, bool at_end, kmp_number d[2])
{
    const bool one = strcmp(kind, "circle") == 0, ring = strcmp(kind, "tube") == 0;
    const char *what = say(e, tapers ? kmp_reader_say(e->r, "%s of the taper", kind) : kind);
    bool good = one || kmp_read_list(e->r, node, what, 2) || fail(e);
    d[1] = number(0);
    for (int k = 0; k < 2 - one && good; k++) {
        const kmp_yaml *own = one ? node : node->items[k];
        good = read_unnamed(e, own, what, at_end ? KMP_FIELD_NOT_NEGATIVE : KMP_FIELD_POSITIVE, KMP_DIM_LENGTH, &d[k]);
    }
    if (good && ring && !(d[0].value > d[1].value))
        return COMPLAIN(e, node, "%s: the outer diameter, %.6g m, is not more than the inner one, %.6g m", what,
                        d[0].value, d[1].value);
    return good;
}

/* The sections of a beam, by their stations: one everywhere, two at its ends, or the sections of a taper with stations.
 */
typedef struct sections {
    int count;
    const kmp_yaml **map; /* each with its kind */
    double *xi;           /* stations over the length */
    const char *kind;     /* of the first one */
} sections;

/* The dimensions along the beam: linear between the sections. */
static bool read_tapered(entry *e, const sections *all, kmp_taper d[2])
{
    kmp_number *values = KMP_ARENA_NEW(&e->r->scratch, kmp_number, 2 * all->count);
    for (int i = 0; i < all->count; i++) {
        const bool at_end = i > 0 && i == all->count - 1;
        kmp_number own[2];
        if (!values || !read_dimensions(e, kmp_yaml_get(all->map[i], all->kind), all->kind, i > 0, at_end, own))
            return false;
        for (int k = 0; k < 2; k++) {
            values[k * all->count + i] = own[k];
            e->beam.reshaped = e->beam.reshaped || (all->count > 1 && own[k].expr);
        }
    }
    for (int k = 0; k < 2; k++)
        d[k] = all->count > 1
                   ? kmp_taper_linear(&e->r->model->arena, all->count, all->xi, values + (ptrdiff_t)k * all->count)
                   : kmp_taper_constant(values[k]);
    return true;
}

static void read_integral(entry *e, const kmp_yaml *map, const char *key, const char *reason, kmp_taper *to)
{
    kmp_number integral = number(0);
    read_wanted(e, map, section_number_keys, key, reason, &integral);
    *to = kmp_taper_constant(integral);
}

static bool read_integrals(entry *e, const kmp_yaml *map, section *s)
{
    static const char *const moments[2] = {"Iz", "Iy"}, *const parts[2] = {"ky", "kz"};
    if (!read_map(e, map, "the section", section_number_keys))
        return false;
    read_integral(e, map, "A", "a section has an area", &s->area);
    for (int k = 0; k < 2; k++) {
        const char *bends = k == 0 ? "shapes along y need it" : "shapes along z need it";
        const char *why = has(e, k) ? bends : e->rotary ? "rotary inertia needs it" : "";
        read_integral(e, map, moments[k], why, &s->about[k]);
        const bool sheared = e->beam.sheared && has(e, k);
        read_wanted(e, map, section_number_keys, parts[k], sheared ? "'shear: yes' needs it" : "", &s->shear[k]);
    }
    read_integral(e, map, "J", has(e, KMP_BEAM_TORSION) ? "torsion needs it" : "", &s->twist);
    return !e->wrong;
}

/* The kind of a section, which is its only key; NULL: an error. */
static const char *read_kind(entry *e, const kmp_yaml *map, const char *what)
{
    static const char *const kinds[] = {"rectangle", "circle", "tube", "numbers"};
    const int kind =
        kmp_read_map(e->r, map, what, section_keys) ? kmp_read_one_key(e->r, map, what, KMP_NAMES_OF(kinds)) : -1;
    if (kind < 0)
        fail(e);
    return kind < 0 ? NULL : kinds[kind];
}

/* Sections beyond the first one are of its kind, whose dimensions are known. */
static void check_kind(entry *e, const kmp_yaml *node, const char *kind)
{
    const char *other = read_kind(e, node, kmp_reader_say(e->r, "the taper of %s", e->body));
    if (!other)
        return;
    if (strcmp(kind, "numbers") == 0)
        COMPLAIN(e, node,
                 "the beam of %s has a section by its integrals, which have no dimensions to taper: give "
                 "'rectangle', 'circle' or 'tube'",
                 e->body);
    else if (strcmp(kind, other) != 0)
        COMPLAIN(e, node,
                 "the beam of %s begins with the section '%s' and tapers to '%s': all of its sections are of one kind",
                 e->body, kind, other);
    else if (e->beam.sheared)
        COMPLAIN(e, node,
                 "the beam of %s has a taper and 'shear: yes': its shear strain is not a polynomial; remove "
                 "one of the two",
                 e->body);
}

/* Station i of a taper, over the length: 0 first, 1 last, ascending, and the same for all parameters. */
static void read_taper_station(entry *e, const kmp_yaml *at, int i, double *xi)
{
    const double rounding = 1e-12;
    const kmp_yaml *node = at->items[i];
    const char *what = kmp_reader_say(e->r, "station %d of the taper of %s", i + 1, e->body);
    const double length = e->beam.length.value;
    kmp_number x;
    if (!kmp_read_number(e->r, node, what, KMP_DIM_LENGTH, &x)) {
        fail(e);
        return;
    }
    xi[i] = x.value / length;
    if (i == 0 && fabs(xi[0]) > rounding)
        COMPLAIN(e, node, "%s is %.6g m: the first one is 0, where the beam begins", what, x.value);
    else if (i == at->count - 1 && fabs(xi[i] - 1) > rounding)
        COMPLAIN(e, node, "%s is %.6g m: the last one is the end of the beam, %.6g m", what, x.value, length);
    else if (i > 0 && !(xi[i] - xi[i - 1] > rounding))
        COMPLAIN(e, node, "%s is %.6g m, which is not beyond the one before it, %.6g m", what, x.value,
                 xi[i - 1] * length);
    else if (!is_fixed_part(e, x))
        COMPLAIN(e, node,
                 "%s depends on parameters, so that its part of the length does: write it as a fixed part of "
                 "the length, such as L/2 of a length L",
                 what);
}

/* {at: [..], section: [..]} */
static void read_stations(entry *e, const kmp_yaml *taper, sections *all)
{
    const char *what = kmp_reader_say(e->r, "the taper of %s", e->body);
    if (!read_map(e, taper, "the taper", taper_keys))
        return;
    const kmp_yaml *at = kmp_read_required(e->r, taper, what, "at"),
                   *list = kmp_read_required(e->r, taper, what, "section");
    if (!at || !list || !kmp_read_list(e->r, at, kmp_reader_say(e->r, "'at' of %s", what), -1) ||
        !kmp_read_list(e->r, list, kmp_reader_say(e->r, "'section' of %s", what), -1)) {
        fail(e);
        return;
    }
    if (at->count < 2 || at->count != list->count) {
        COMPLAIN(e, list, "%s has %d station%s and %d section%s: two or more are expected, and as many of both", what,
                 at->count, at->count == 1 ? "" : "s", list->count, list->count == 1 ? "" : "s");
        return;
    }
    all->count = at->count;
    all->map = KMP_ARENA_NEW(&e->r->scratch, const kmp_yaml *, all->count);
    all->xi = KMP_ARENA_NEW(&e->r->scratch, double, all->count);
    for (int i = 0; all->map && all->xi && i < all->count; i++) {
        all->map[i] = list->items[i];
        read_taper_station(e, at, i, all->xi);
    }
}

/* The sections by 'section', or with a 'taper' at the far end, or only by a taper with stations. */
static bool find_sections(entry *e, const kmp_yaml *beam, sections *all)
{
    static const double ends[2] = {0, 1};
    const kmp_yaml *map = kmp_yaml_get(beam, "section"), *taper = kmp_yaml_get(beam, "taper");
    if (map && has_stations(taper))
        return COMPLAIN(e, map,
                        "the beam of %s has a section and a taper with stations, which has all of its sections: "
                        "remove 'section'",
                        e->body);
    if (has_stations(taper)) {
        read_stations(e, taper, all);
    } else {
        all->count = taper ? 2 : 1;
        all->map = KMP_ARENA_NEW(&e->r->scratch, const kmp_yaml *, 2);
        all->xi = KMP_ARENA_NEW(&e->r->scratch, double, 2);
        for (int i = 0; all->map && all->xi && i < all->count; i++) {
            all->map[i] = i == 0 ? map : taper;
            all->xi[i] = ends[i];
        }
    }
    return all->map && all->xi && !e->wrong;
}

static bool read_section(entry *e, const kmp_yaml *beam, kmp_number poisson, section *s)
{
    sections all = {.count = 0};
    kmp_taper d[2];
    if (!find_sections(e, beam, &all))
        return false;
    all.kind = read_kind(e, all.map[0], kmp_reader_say(e->r, "the section of %s", e->body));
    for (int i = 1; all.kind && i < all.count; i++)
        check_kind(e, all.map[i], all.kind);
    if (!all.kind || e->wrong)
        return false;
    const char *kind = all.kind;
    if (strcmp(kind, "numbers") == 0)
        return read_integrals(e, kmp_yaml_get(all.map[0], kind), s);
    if (!read_tapered(e, &all, d))
        return false;
    if (strcmp(kind, "rectangle") == 0)
        take_rectangle(e, d, poisson, s);
    else
        take_ring(e, d, poisson, s);
    return true;
}

/* -- what it is made of ------------------------------------------------------------------------------ */

/* Young's modulus is known. Poisson's ratio follows from the shear modulus, or it from that. */
static bool read_shear_modulus(entry *e, const kmp_yaml *map, kmp_number young, kmp_number *modulus,
                               kmp_number *poisson)
{
    const kmp_yaml *shear = kmp_yaml_get(map, "shear"), *ratio = kmp_yaml_get(map, "poisson");
    if (shear && ratio)
        return COMPLAIN(e, ratio,
                        "the beam of %s has a shear modulus, which gives Poisson's ratio: remove one of the two",
                        e->body);
    if (shear &&
        read_unnamed(e, shear, say(e, "shear"), KMP_FIELD_POSITIVE, kmp_key_dimension(beam_keys, "shear"), modulus))
        *poisson = plus(e, over(e, young, scale(e, 2, *modulus)), number(-1));
    if (ratio && !kmp_read_number(e->r, ratio, say(e, "poisson"), KMP_DIM_NUMBER, poisson))
        return fail(e);
    if (ratio && !(poisson->value > -1 && poisson->value <= 0.5))
        return COMPLAIN(e, ratio, "%s is %.6g: it must be more than -1 and at most 0.5", say(e, "poisson"),
                        poisson->value);
    poisson->symbol = 0;
    if (ratio)
        *modulus = over(e, young, scale(e, 2, plus(e, number(1), *poisson)));
    if (shear || ratio || (!has(e, KMP_BEAM_TORSION) && !e->beam.sheared))
        return !e->wrong;
    return COMPLAIN(e, map, "the beam of %s has neither 'shear' nor 'poisson': %s needs one of them", e->body,
                    has(e, KMP_BEAM_TORSION) ? "torsion" : "'shear: yes'");
}

static void read_by_section(entry *e, const kmp_yaml *map)
{
    static const char *const others[] = {"EA", "EIy", "EIz", "GJ", "kGA", "rhoA", "rhoI"};
    kmp_number young = number(1), density = number(1), modulus = number(0), poisson = number(0);
    kmp_beam *b = &e->beam;
    section s = {.area = {0}};
    for (size_t k = 0; k < sizeof others / sizeof *others; k++)
        if (kmp_yaml_get(map, others[k]))
            COMPLAIN(e, kmp_yaml_get(map, others[k]),
                     "the beam of %s has a section, which gives '%s': remove one of the two", e->body, others[k]);
    read_wanted(e, map, beam_keys, "young", "its section needs it", &young);
    read_wanted(e, map, beam_keys, "density", "its section needs it", &density);
    if (!read_shear_modulus(e, map, young, &modulus, &poisson) || !read_section(e, map, poisson, &s))
        return;
    b->line_mass = multiple(e, density, &s.area);
    for (int k = 0; k < 2; k++) {
        b->section_mass[k] = multiple(e, e->rotary ? density : number(0), &s.about[k]);
        b->stiffness[k] = multiple(e, young, &s.about[k]);
        b->shear[k] = times(e, modulus, times(e, s.area.c[0], s.shear[k]));
    }
    b->section[0] = s.area;
    b->section[1] = s.about[0];
    b->section[2] = s.about[1];
    b->edge[0] = s.edge[0];
    b->edge[1] = s.edge[1];
    b->round = s.round;
    b->stiffness[KMP_BEAM_TORSION] = multiple(e, modulus, &s.twist);
    b->stiffness[KMP_BEAM_AXIAL] = multiple(e, young, &s.area);
}

static void read_by_numbers(entry *e, const kmp_yaml *map)
{
    static const char *const keys[KMP_BEAM_FAMILIES] = {"EIz", "EIy", "GJ", "EA"};
    static const char *const others[] = {"young", "shear", "poisson", "density", "taper"};
    kmp_beam *b = &e->beam;
    kmp_number inertia[2] = {number(0), number(0)};
    for (size_t k = 0; k < sizeof others / sizeof *others; k++)
        if (kmp_yaml_get(map, others[k]))
            COMPLAIN(e, kmp_yaml_get(map, others[k]), "the beam of %s has '%s' without a section: give the section",
                     e->body, others[k]);
    if (e->wrong)
        return;
    kmp_number line = number(0), stiffness[KMP_BEAM_FAMILIES] = {number(0)};
    read_wanted(e, map, beam_keys, "rhoA", "give it, or a section with its density", &line);
    b->line_mass = kmp_taper_constant(line);
    for (int k = 0; k < KMP_BEAM_FAMILIES; k++) {
        read_wanted(e, map, beam_keys, keys[k],
                    has(e, k) ? kmp_reader_say(e->r, "shapes '%s' need it", families[k]) : "", &stiffness[k]);
        b->stiffness[k] = kmp_taper_constant(stiffness[k]);
    }
    read_two(e, map, "kGA", b->sheared ? "'shear: yes' needs it" : "", b->shear);
    read_two(e, map, "rhoI", e->rotary ? "rotary inertia needs it" : "", inertia);
    for (int k = 0; k < 2 && e->rotary; k++)
        b->section_mass[k] = kmp_taper_constant(inertia[1 - k]); /* rho Iy is of z^2 */
}

/* The axes of the beam, by its direction or by one or two of them. */
static void read_direction(entry *e, const kmp_yaml *map)
{
    const kmp_yaml *along = kmp_yaml_get(map, "along"), *axes = kmp_yaml_get(map, "axes");
    static const double straight[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    double x[3];
    if (along && axes) {
        COMPLAIN(e, axes, "the beam of %s has 'axes', which give 'along': remove one of the two", e->body);
    } else if ((along && !kmp_read_axis(e->r, along, say(e, "along"), x)) ||
               (axes && !kmp_read_axes(e->r, axes, say(e, "axes"), e->beam.axes))) {
        fail(e);
    } else if (along) {
        kmp_complete_axes(0, x, e->beam.axes);
    }
    e->beam.turned = !e->wrong && (along || axes) && memcmp(e->beam.axes, straight, sizeof straight) != 0;
}

static void read_beam(entry *e, const kmp_yaml *map)
{
    if (!read_map(e, map, "the beam", beam_keys))
        return;
    read_wanted(e, map, beam_keys, "length", "a beam has a length", &e->beam.length);
    read_direction(e, map);
    if (kmp_yaml_get(map, "section") || has_stations(kmp_yaml_get(map, "taper")))
        read_by_section(e, map);
    else
        read_by_numbers(e, map);
}

/* -- shapes, damping --------------------------------------------------------------------------------- */

static void read_count(entry *e, const kmp_yaml *map, kmp_beam_family family)
{
    const kmp_yaml *node = kmp_yaml_get(map, families[family]);
    const char *what = kmp_reader_say(e->r, "shapes '%s' of %s", families[family], e->body);
    double count;
    if (!node)
        return;
    if (kmp_read_whole(e->r, node, what, "are", 0, KMP_BEAM_MOST, &count))
        e->beam.count[family] = (int)count;
    else
        fail(e);
}

static void read_shapes(entry *e, const kmp_yaml *map)
{
    int sum = 0;
    bool parameters = false;
    if (!read_map(e, map, "the shapes", shape_keys))
        return;
    for (int f = 0; f < KMP_BEAM_FAMILIES; f++) {
        read_count(e, map, (kmp_beam_family)f);
        sum += e->beam.count[f];
        const kmp_yaml *count = kmp_yaml_get(map, families[f]); /* a number itself, or an expression of parameters */
        parameters = parameters || (count && count->text && strcspn(count->text, "0123456789") > 0);
    }
    if (sum > 0 || e->wrong || e->r->bodies_as || parameters)
        return;
    COMPLAIN(e, map, "%s has no shapes: without them it is rigid; give 'y', 'z', 'torsion' or 'axial'", e->body);
}

static void read_damping(entry *e, const kmp_yaml *map)
{
    static const char *const kinds[] = {"ratio", "rayleigh"};
    const char *what = kmp_reader_say(e->r, "the damping of %s", e->body);
    const int kind =
        kmp_read_map(e->r, map, what, damping_keys) ? kmp_read_one_key(e->r, map, what, KMP_NAMES_OF(kinds)) : -1;
    const kmp_yaml *node = kind >= 0 ? kmp_yaml_get(map, kinds[kind]) : NULL;
    const char *of = node ? kmp_reader_say(e->r, "%s of the damping of %s", kinds[kind], e->body) : "";
    if (!node || (kind == 1 && !kmp_read_list(e->r, node, of, 2)))
        fail(e);
    else if (kind == 0)
        read_unnamed(e, node, of, KMP_FIELD_NOT_NEGATIVE, KMP_DIM_NUMBER, &e->beam.ratio);
    else
        for (int k = 0; k < 2; k++)
            read_unnamed(e, node->items[k], of, KMP_FIELD_NOT_NEGATIVE, KMP_DIM(0, 0, 2 * k - 1), &e->beam.rayleigh[k]);
}

/* -- the whole key ----------------------------------------------------------------------------------- */

/* Keys of beams and keys of files are not mixed. */
static void check_source(entry *e, const kmp_yaml *map, bool file)
{
    static const char *const of_beams[] = {"beam", "segments", "shapes", "shear", "rotary", "raw", NULL},
                             *const of_files[] = {"interfaces", "modes", "nodes", "scale", NULL};
    for (const char *const *key = file ? of_beams : of_files; *key; key++)
        if (kmp_yaml_get(map, *key))
            COMPLAIN(e, kmp_yaml_get(map, *key), "flexible of %s: '%s' is a key of %s", e->body, *key,
                     file ? "beams, and its modes are in a file" : "bodies from files, and it has none");
}

static void read_flexible(entry *e, const kmp_yaml *map)
{
    static const char *const frames[] = {"clamped", "chord", "mean"}, *const stiffenings[] = {"none", "first", "full"};
    kmp_reader *r = e->r;
    const char *what = kmp_reader_say(r, "flexible of %s", e->body);
    if (!read_map(e, map, "flexible", flexible_keys))
        return;
    e->beam.frame = (kmp_flexible_frame)read_word(e, map, "frame", KMP_NAMES_OF(frames), KMP_FRAME_CLAMPED);
    if (kmp_yaml_get(map, "file")) {
        e->of_file = true;
        check_source(e, map, true);
        if (kmp_yaml_get(map, "damping"))
            read_damping(e, kmp_yaml_get(map, "damping"));
        e->file = kmp_read_modal_body(e->r, map, e->body, e->beam.frame);
        if (e->file)
            e->file->damped = kmp_yaml_get(map, "damping");
        else
            fail(e);
        return;
    }
    check_source(e, map, false);
    const kmp_yaml *beam = kmp_read_required(r, map, what, "beam"), *shapes = kmp_read_required(r, map, what, "shapes");
    if (shapes)
        read_shapes(e, shapes);
    const bool twists = has(e, KMP_BEAM_TORSION);
    e->beam.sheared = read_flag(e, map, "shear", false);
    e->beam.raw = read_flag(e, map, "raw", false);
    e->rotary = read_flag(e, map, "rotary", twists);
    if (!e->rotary && twists && kmp_yaml_get(map, "rotary"))
        COMPLAIN(e, kmp_yaml_get(map, "rotary"),
                 "rotary of %s: torsion moves no mass without the inertia of its sections", e->body);
    e->beam.stiffening = (kmp_stiffening)read_word(e, map, "stiffening", KMP_NAMES_OF(stiffenings),
                                                   twists ? KMP_STIFFENING_FULL : KMP_STIFFENING_FIRST);
    if (kmp_yaml_get(map, "damping") && !kmp_yaml_get(map, "segments"))
        read_damping(e, kmp_yaml_get(map, "damping"));
    if (beam && shapes)
        read_beam(e, beam);
    else
        fail(e);
}

bool kmp_read_beam(kmp_reader *r, const kmp_yaml *map, const char *body, kmp_beam *beam)
{
    entry e = {.r = r, .body = body};
    read_flexible(&e, map);
    *beam = e.beam;
    return !e.wrong;
}

/* The station at x, 1 and on; 0: no memory. */
static int find_station(entry *e, kmp_number x)
{
    for (int k = 0; k < e->station_count; k++)
        if (kmp_number_same(e->stations[k], x))
            return k + 1;
    if (!KMP_ARENA_GROW(&e->r->scratch, e->stations, e->station_count))
        return 0;
    e->stations[e->station_count] = x;
    return ++e->station_count;
}

void kmp_begin_flexible(kmp_reader *r, const kmp_yaml *map, int body)
{
    kempe_model *model = r->model;
    const kmp_yaml *node = kmp_yaml_get(map, "flexible");
    if (!node)
        return;
    if (!KMP_ARENA_GROW(&model->arena, model->flexibles, model->flexible_count) ||
        !KMP_ARENA_GROW(&r->scratch, r->flexibles, model->flexible_count))
        return;
    entry *e = &r->flexibles[model->flexible_count];
    *e = (entry){.r = r, .body = kmp_reader_say(r, "body '%s'", model->bodies[body].name)};
    model->flexibles[model->flexible_count] = (kmp_flexible){.body = body};
    model->bodies[body].flexible = ++model->flexible_count;
    if (find_station(e, number(0)) > 0)
        read_flexible(e, node);
}

static entry *entry_of(const kmp_reader *r, int body)
{
    const int own = r->model->bodies[body].flexible;
    return own > 0 ? &r->flexibles[own - 1] : NULL;
}

/* -- points ------------------------------------------------------------------------------------------ */

static bool is_origin(const kmp_number at[3])
{
    bool origin = true;
    for (int k = 0; k < 3; k++)
        origin = origin && kmp_number_is_nothing(at[k]);
    return origin;
}

/* A place by station and offset. */
static void take_station(entry *e, const kmp_yaml *map, const char *what, kmp_point *point)
{
    kmp_reader *r = e->r;
    const kmp_yaml *node = kmp_yaml_get(map, "station"), *offset = kmp_yaml_get(map, "offset");
    const char *of = kmp_reader_say(r, "the station of %s", what);
    const double rounding = 1e-12;
    kmp_number x;
    if (kmp_yaml_get(map, "at"))
        kmp_reader_complain(r, kmp_yaml_get(map, "at")->place, "%s has a station, which is its place: remove 'at'",
                            what);
    if (offset &&
        kmp_read_vector(r, offset, kmp_reader_say(r, "the offset of %s", what), KMP_DIM_LENGTH, point->offset))
        for (int k = 0; k < 3; k++)
            point->offset[k].symbol = 0;
    if (!kmp_read_ruled(r, node, of, KMP_DIM_LENGTH, KMP_FIELD_NOT_NEGATIVE, &x))
        return;
    if (!e->wrong && x.value > e->beam.length.value * (1 + rounding)) {
        kmp_reader_complain(r, node->place, "%s is %.6g m: the beam is %.6g m long", of, x.value, e->beam.length.value);
        return;
    }
    x.symbol = 0;
    point->station = find_station(e, x);
    for (int k = 0; k < 3; k++)
        point->at[k] = plus(e, kmp_beam_part(&e->r->model->arena, &e->beam, k, x), point->offset[k]);
}

/* Reports keys of stations; false: the point has one of them. */
static bool has_no_station(kmp_reader *r, const kmp_yaml *node, const char *what, const char *why)
{
    static const char *const keys[] = {"station", "interface", "node", "offset"};
    for (int k = 0; k < 4; k++) {
        const kmp_yaml *own = kmp_yaml_get(node, keys[k]);
        if (own)
            return kmp_reader_complain(r, own->place, "%s has the key '%s': %s", what, keys[k], why);
    }
    return true;
}

/* True if a place is in the section where the beam begins: it has no part along it. */
static bool is_at_start(const entry *e, const kmp_number at[3])
{
    const double rounding = 1e-12;
    double along = 0, size = 0;
    bool varies = false;
    for (int k = 0; k < 3; k++) {
        const double part = e->beam.turned ? e->beam.axes[k][0] : k == 0;
        along += part * at[k].value;
        size += fabs(part * at[k].value);
        varies = varies || (part != 0 && at[k].expr);
    }
    return fabs(along) <= rounding * size && !varies;
}

void kmp_read_point_place(kmp_reader *r, const kmp_yaml *node, const char *what, kmp_point *point)
{
    entry *e = entry_of(r, point->body);
    if (e && e->of_file) {
        if (e->file)
            kmp_read_modal_point(r, e->file, node, what, point);
        return;
    }
    if (e && kmp_yaml_get(node, "station")) {
        take_station(e, node, what, point);
        return;
    }
    if (!has_no_station(r, node, what,
                        e ? "it is from a station, which is missing" : "its body is rigid, and has no stations"))
        return;
    if (node->kind == KMP_YAML_MAP)
        node = kmp_read_required(r, node, what, "at");
    if (!node || !kmp_read_vector(r, node, what, KMP_DIM_LENGTH, point->at) || !e || e->wrong)
        return;
    if (!is_at_start(e, point->at) || e->beam.frame != KMP_FRAME_CLAMPED)
        kmp_complain_of(r, node, what,
                        "%s is flexible, so that its points are moved by its sections: give the station instead of %s, "
                        "such as {station: %s, offset: [0, 0, 0]}",
                        e->body, e->beam.turned ? "a place" : "x", e->beam.turned ? "0" : node->items[0]->text);
}

void kmp_check_flexible_joint(kmp_reader *r, int body, const kmp_yaml *at, const kmp_yaml *to)
{
    kmp_body *own = &r->model->bodies[body];
    const entry *e = entry_of(r, body), *parent = entry_of(r, own->parent);
    const kmp_point *point = own->to >= 0 ? &r->model->points[own->to] : NULL;
    if (e && point && e->beam.frame == KMP_FRAME_MEAN)
        kmp_reader_complain(
            r, to->place,
            "the joint of %s holds it at '%s': in the frame 'mean' its free joint places the mean axes, "
            "and no point: leave out 'to'",
            e->body, point->name);
    else if (e && point && point->station == 1 && is_origin(point->offset) && !point->turned)
        own->to = -1;
    else if (e && point)
        kmp_reader_complain(
            r, to->place,
            "the joint of %s holds it at '%s': the joint that carries a flexible body is at its origin; "
            "another joint of its loop can be cut, or carry it",
            e->body, point->name);
    if (parent && at && own->at < 0 && parent->beam.frame != KMP_FRAME_CLAMPED)
        kmp_reader_complain(
            r, at->place,
            "the joint of body '%s' is at the origin of %s, whose sections turn in its frame: give a point "
            "with the station 0",
            own->name, parent->body);
}

void kmp_check_flexible_ground(kmp_reader *r, const kmp_yaml *at, int body, int point)
{
    const entry *e = entry_of(r, body);
    if (e && e->beam.frame != KMP_FRAME_CLAMPED && (point < 0 || r->model->points[point].station == 0))
        kmp_reader_complain(r, at->place,
                            "'at' of an include: %s is flexible, and its axes belong to none of its sections: give a "
                            "point with a station or an interface",
                            e->body);
}

void kmp_check_flexible_mass(kmp_reader *r, const kmp_yaml *map, int body)
{
    static const char *const given[] = {"mass", "com", "inertia"};
    const entry *e = entry_of(r, body);
    if (e && e->file && kmp_yaml_get(map, "mass"))
        kmp_check_modal_mass(r, e->file, kmp_yaml_get(map, "mass"));
    for (int k = e && e->of_file; e && k < 3; k++)
        if (kmp_yaml_get(map, given[k]))
            kmp_reader_complain(r, kmp_yaml_get(map, given[k])->place,
                                "%s is flexible, and its %s gives its %s: remove one of the two", e->body,
                                e->of_file ? "file" : "beam", given[k]);
}

/* -- constants and coordinates ----------------------------------------------------------------------- */

static void add_coordinate(kmp_reader *r, int body, const char *kind, int number_of_kind, bool rotation)
{
    kempe_model *model = r->model;
    const char *name = kmp_arena_printf(&model->arena, "%s.%s%d", model->bodies[body].name, kind, number_of_kind);
    if (name)
        (void)kmp_reader_add_motion(
            r, (kmp_motion){.name = name, .body = body, .rotation = rotation, .elastic = true, .axis = {0, 0, 1}});
}

static void make_modal_body(entry *e, kmp_flexible *flexible)
{
    flexible->file = e->file->path;
    flexible->frame = e->beam.frame;
    flexible->stiffening = e->file->stiffening;
    flexible->doubt = e->file->doubt;
    flexible->averaged = e->file->modal.known != KMP_MODAL_ALL;
    for (int k = 0; k < e->file->modal.count; k++)
        add_coordinate(e->r, flexible->body, "mode", k + 1, false);
    if (!kmp_modal_make(&e->r->model->arena, &e->file->modal, e->file->damped, e->beam.ratio, e->beam.rayleigh,
                        flexible))
        e->r->model->arena.failed = true;
}

static void make_beam(entry *e, kmp_flexible *flexible)
{
    kempe_model *model = e->r->model;
    static const char *const names[KMP_BEAM_FAMILIES] = {"y", "z", "phi", "x"};
    for (int f = 0; f < KMP_BEAM_FAMILIES; f++)
        for (int k = 0; k < e->beam.count[f]; k++)
            add_coordinate(e->r, flexible->body, names[f], k + 1, f == KMP_BEAM_TORSION);
    e->beam.stations = e->stations;
    e->beam.station_count = e->station_count;
    bool *fixed = KMP_ARENA_NEW(&e->r->scratch, bool, e->station_count);
    for (int k = 0; fixed && k < e->station_count; k++)
        fixed[k] = is_fixed_part(e, e->stations[k]);
    e->beam.fixed = fixed;
    if (!e->wrong && e->stations && e->beam.fixed && !kmp_beam_make(&model->arena, &e->beam, flexible) &&
        !model->arena.failed)
        kmp_reader_complain(e->r, model->bodies[flexible->body].place,
                            "the beam of %s: its constants are not finite: its numbers are too large or too small",
                            e->body);
    kmp_beam *kept = KMP_ARENA_NEW(&model->arena, kmp_beam, 1);
    if (!kept)
        return;
    *kept = e->beam;
    kept->stations = NULL;
    kept->station_count = 0;
    kept->fixed = NULL;
    flexible->beam = kept;
}

/* Mean axes are not a section that a joint could hold. */
static void check_mean(kmp_reader *r, const entry *e, const kmp_body *body)
{
    int rotations = 0;
    for (int k = 0; k < body->motion_count; k++)
        rotations += r->model->motions[body->first_motion + k].rotation;
    if (e->beam.frame != KMP_FRAME_MEAN || (body->motion_count == 6 && rotations == 3))
        return;
    kmp_reader_complain(r, body->place,
                        "%s has the frame 'mean', which no joint can hold: give it a free joint, {free: x, at: "
                        "ground}, and 'loops' at its points, or take the frame 'clamped' or 'chord'",
                        e->body);
}

void kmp_read_flexibles(kmp_reader *r)
{
    kempe_model *model = r->model;
    for (int i = 0; i < model->flexible_count; i++) {
        kmp_flexible *flexible = &model->flexibles[i];
        entry *e = &r->flexibles[i];
        flexible->first = model->motion_count;
        check_mean(r, e, &model->bodies[flexible->body]);
        if (e->file)
            make_modal_body(e, flexible);
        else if (!e->of_file)
            make_beam(e, flexible);
    }
}

/* Deflections along one axis stay in the plane across the other. Modes of a file may be in space. */
bool kmp_flexible_in_plane(const kmp_reader *r, int body, const double normal[3])
{
    const entry *e = entry_of(r, body);
    if (e && e->of_file)
        return false;
    double across[3] = {0};
    for (int c = 0; e && c < 3; c++)
        for (int k = 0; k < 3; k++)
            across[c] += (e->beam.turned ? e->beam.axes[k][c] : k == c) * normal[k];
    return !e || (!has(e, KMP_BEAM_TORSION) && across[0] == 0 && (!has(e, KMP_BEAM_Y) || across[1] == 0) &&
                  (!has(e, KMP_BEAM_Z) || across[2] == 0));
}
