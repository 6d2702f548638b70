/* SPDX-License-Identifier: BSD-3-Clause */
/* All that derivation finds: rows, patterns, conditions, programs. Parts that follow from the model at little cost are
 * made again. Conditions refer to parts of the model by their places in its arena, which are the same for equal files.
 */
#include "dynamics/system_record.h"
#include "base/memory.h"
#include "dynamics/motion.h"
#include "dynamics/program_cache.h"
#include "model/data/model.h"
#include "platform/platform.h"
#include "symbolic/program_bytes.h"
#include <string.h>

static const kmp_program_cache_name whole = {.what = "system"}, by_bodies = {.what = "bodies"},
                                    by_mass = {.what = "motion"};

enum { MOST = 1 << 30 };

/* Writes the bytes of a part, and frees them. */
static void finish(const kempe_system *s, kmp_program_cache_name name, kmp_bytes *bytes, kmp_table_pool *pool)
{
    kmp_program_cache_write(s, name, bytes);
    kmp_table_pool_free(pool);
    kmp_bytes_free(bytes);
}

/* -- patterns ---------------------------------------------------------------------------------------- */

static void put_pattern(kmp_bytes *b, const kmp_pattern *p)
{
    kmp_bytes_put_int(b, p->count);
    KMP_BYTES_PUT(b, p->row, p->count);
    KMP_BYTES_PUT(b, p->col, p->count);
}

static void take_pattern(kmp_byte_source *s, kmp_arena *arena, int rows, int cols, kmp_pattern *p)
{
    int count = kmp_bytes_take_count(s, 2 * sizeof(int));
    *p = (kmp_pattern){count, KMP_ARENA_NEW(arena, int, count), KMP_ARENA_NEW(arena, int, count)};
    if (arena->failed)
        return;
    KMP_BYTES_TAKE(s, p->row, count);
    KMP_BYTES_TAKE(s, p->col, count);
    for (int k = 0; k < count; k++)
        s->failed = s->failed || p->row[k] < 0 || p->row[k] >= rows || p->col[k] < 0 || p->col[k] >= cols;
}

/* -- conditions -------------------------------------------------------------------------------------- */

/* A part of the model; bytes fail for what is not in its arena. */
static void put_part(kmp_bytes *b, const kempe_model *model, const void *part)
{
    kmp_arena_spot spot = {-1, 0};
    b->failed = b->failed || (part && !kmp_arena_find(&model->arena, part, &spot));
    kmp_bytes_put_int(b, spot.block);
    kmp_bytes_put_int(b, (int64_t)spot.offset);
}

static void *take_part(kmp_byte_source *s, const kempe_model *model, size_t size)
{
    kmp_arena_spot spot = {.block = kmp_bytes_take_int(s, -1, MOST)};
    spot.offset = (size_t)kmp_bytes_take_int(s, 0, MOST);
    if (spot.block < 0)
        return NULL;
    void *part = kmp_arena_at(&model->arena, spot, size);
    s->failed = s->failed || !part;
    return part;
}

/* The text of an event is made again, and compared: the expression is the same one. */
static void take_condition(kmp_byte_source *b, kempe_system *s, int k)
{
    kmp_condition *c = &s->events.condition[k];
    kmp_arena aside = {0};
    c->of = take_part(b, s->model, 1);
    c->expr = take_part(b, s->model, sizeof *c->expr);
    c->number = kmp_bytes_take_int(b, -MOST, MOST);
    const char *text = kmp_bytes_take_text(b, &aside);
    c->text = text ? kmp_strdup(text) : NULL;
    c->advice = kmp_bytes_take_text(b, &s->arena);
    const char *shown = kmp_bytes_take_text(b, &aside);
    int flags = kmp_bytes_take_int(b, 0, 512 * KMP_ROLE_END - 1);
    c->validity = (kmp_validity)kmp_bytes_take_int(b, 0, KMP_VALIDITY_END - 1);
    c->ends = flags & 1;
    c->kink = flags >> 1 & 1;
    c->late = flags >> 2 & 1;
    c->measured = flags >> 3 & 1;
    c->bend = flags >> 4 & 1;
    c->rough = flags >> 5 & 1;
    c->by_rates = flags >> 6 & 1;
    c->at_start = flags >> 7 & 1;
    c->silent = flags >> 8 & 1;
    c->role = (kmp_role)(flags >> 9);
    kmp_bytes_take(b, &c->lag, sizeof c->lag);
    b->failed = b->failed || !c->of || (!c->expr && !c->text) || (text && !c->text);
    s->event_text[k] = b->failed ? NULL : kmp_system_event_text(s, c);
    b->failed = b->failed || !shown || !s->event_text[k] || strcmp(shown, s->event_text[k]) != 0;
    kmp_arena_free(&aside);
}

static void put_events(kmp_bytes *b, const kempe_system *s)
{
    kmp_bytes_put_int(b, s->events.count);
    kmp_bytes_put_int(b, s->use_count);
    for (int k = 0; k < s->use_count; k++) {
        kmp_bytes_put_int(b, s->use[k].table);
        kmp_bytes_put_int(b, s->use[k].variable);
    }
    for (int k = 0; k < s->events.count; k++) {
        const kmp_condition *c = &s->events.condition[k];
        put_part(b, s->model, c->of);
        put_part(b, s->model, c->expr);
        kmp_bytes_put_int(b, c->number);
        kmp_bytes_put_text(b, c->text);
        kmp_bytes_put_text(b, c->advice);
        kmp_bytes_put_text(b, s->event_text[k]);
        kmp_bytes_put_int(b, c->ends | c->kink << 1 | c->late << 2 | c->measured << 3 | c->bend << 4 | c->rough << 5 |
                                 c->by_rates << 6 | c->at_start << 7 | c->silent << 8 | (int)c->role << 9);
        kmp_bytes_put_int(b, (int)c->validity);
        kmp_bytes_put(b, &c->lag, sizeof c->lag);
    }
}

static void take_events(kmp_byte_source *b, kempe_system *s)
{
    int count = kmp_bytes_take_count(b, 1);
    s->use_count = kmp_bytes_take_count(b, 1);
    s->use = KMP_ARENA_NEW(&s->arena, kmp_table_use, s->use_count + 1);
    s->left = KMP_ARENA_NEW(&s->arena, atomic_bool, count + 2 * s->use_count + 1);
    for (int k = 0; s->use && k < s->use_count; k++) {
        s->use[k].table = kmp_bytes_take_int(b, 0, s->model->table_count - 1);
        s->use[k].variable = kmp_bytes_take_int(b, 0, 1);
    }
    if (count == 0)
        return;
    s->events.condition = KMP_NEW(kmp_condition, count);
    s->event_text = KMP_ARENA_NEW(&s->arena, char *, count);
    b->failed = b->failed || !s->events.condition || !s->event_text || !s->left;
    for (int k = 0; !b->failed && k < count; k++) {
        s->events.count = k + 1;
        take_condition(b, s, k);
    }
}

/* -- articulated bodies ------------------------------------------------------------------------------ */

static void name_bodies(const kempe_system *s)
{
    kmp_program_cache_name_program(s, (kmp_program_cache_name){.what = "code of bodies"}, s->bodies->program);
}

void kmp_bodies_keep(const kempe_system *s)
{
    kmp_bytes b = {0};
    kmp_table_pool pool = {0};
    if (!s->has_key)
        return;
    name_bodies(s);
    kmp_program_put(&b, &pool, s->bodies->program);
    finish(s, by_bodies, &b, &pool);
}

bool kmp_bodies_recall(const kempe_system *s)
{
    kmp_bodies *bodies = s->bodies;
    kmp_cached file = kmp_program_cache_recall(s, by_bodies);
    kmp_byte_source b = kmp_byte_source_of(file.bytes, file.size);
    kmp_table_pool pool = {0};
    if (!file.whole)
        return false;
    bodies->program = kmp_program_get(&b, &pool);
    kmp_table_pool_free(&pool);
    kmp_free(file.whole);
    if (!b.failed && b.at == b.end) {
        name_bodies(s);
        return true;
    }
    kmp_bodies_forget(bodies);
    return false;
}

/* -- the whole --------------------------------------------------------------------------------------- */

/* -- M and C that waited ------------------------------------------------------------------------------ */

static void name_motion(const kempe_system *s, kmp_program *motion)
{
    kmp_program_cache_name_program(s, (kmp_program_cache_name){.what = "code"}, motion);
}

void kmp_motion_keep(const kempe_system *s)
{
    kmp_bytes b = {0};
    kmp_table_pool pool = {0};
    if (!s->has_key)
        return;
    name_motion(s, s->motion);
    kmp_program_put(&b, &pool, s->motion);
    finish(s, by_mass, &b, &pool);
}

kmp_program *kmp_motion_recall(const kempe_system *s)
{
    kmp_cached file = kmp_program_cache_recall(s, by_mass);
    kmp_byte_source b = kmp_byte_source_of(file.bytes, file.size);
    kmp_table_pool pool = {0};
    if (!file.whole)
        return NULL;
    kmp_program *motion = kmp_program_get(&b, &pool);
    kmp_table_pool_free(&pool);
    kmp_free(file.whole);
    if (motion && !b.failed && b.at == b.end && motion->stages > KMP_STAGE_BIAS) {
        name_motion(s, motion);
        return motion;
    }
    kmp_program_free(motion);
    return NULL;
}

/* -- the programs ------------------------------------------------------------------------------------- */

enum { PROGRAMS = 4 };

/* The first one is the program of M if M and C wait. */
static void list_programs(kempe_system *s, kmp_program **list[PROGRAMS])
{
    kmp_program **const all[PROGRAMS] = {s->late ? &s->late->weighing : &s->motion, &s->judge, &s->changes, &s->goals};
    memcpy(list, all, sizeof all);
}

static void name_programs(kempe_system *s)
{
    kmp_program **list[PROGRAMS];
    list_programs(s, list);
    for (unsigned k = 0; k < PROGRAMS; k++)
        kmp_program_cache_name_program(
            s, (kmp_program_cache_name){.what = k == 0 && s->late ? "code of M" : "code", .variant = k}, *list[k]);
}

void kmp_system_keep(kempe_system *s)
{
    kmp_bytes b = {0};
    kmp_table_pool pool = {0};
    kmp_program **list[PROGRAMS];
    if (!s->has_key)
        return;
    list_programs(s, list);
    name_programs(s);
    kmp_bytes_put_int(&b, s->n);
    kmp_bytes_put_int(&b, s->m);
    KMP_BYTES_PUT(&b, s->rows, s->m);
    KMP_BYTES_PUT(&b, s->misfit, s->model->closure_count);
    /* Flags. */
    const int flags[] = {s->rheonomic, s->switches,         s->dissipative,
                         s->has_power, s->changes_by_rates, atomic_load(&s->rounding->state) == KMP_ROUNDING_NONE};
    for (size_t k = 0; k < sizeof flags / sizeof *flags; k++)
        kmp_bytes_put_int(&b, flags[k]);
    kmp_bytes_put_int(&b, s->dynamics);
    put_pattern(&b, &s->jacobian);
    put_pattern(&b, &s->mass);
    put_pattern(&b, &s->load_jacobian);
    kmp_bytes_put_int(&b, s->load_row_count);
    KMP_BYTES_PUT(&b, s->load_rows, s->load_row_count);
    put_events(&b, s);
    kmp_bytes_put_int(&b, s->late ? 1 + s->late->by_products : 0);
    if (s->late)
        kmp_savings_put(&b, &s->late->chosen, s->model);
    kmp_savings_put(&b, &s->bodies->first, s->model);
    for (int k = 0; k < PROGRAMS; k++)
        kmp_program_put(&b, &pool, *list[k]);
    finish(s, whole, &b, &pool);
    if (atomic_load(&s->bodies->made))
        kmp_bodies_keep(s);
    if (s->late && !s->late->by_links && !s->late->by_products && atomic_load(&s->late->made))
        kmp_motion_keep(s);
}

static bool take_rows(kmp_byte_source *b, kempe_system *s)
{
    kmp_arena room = {0};
    int n = kmp_bytes_take_int(b, 0, s->model->motion_count), m = kmp_bytes_take_count(b, sizeof(kmp_row));
    kmp_row *rows = KMP_ARENA_NEW(&room, kmp_row, m);
    double *misfit = KMP_ARENA_NEW(&room, double, s->model->closure_count);
    bool good = rows && misfit && n == s->model->motion_count;
    if (good) {
        KMP_BYTES_TAKE(b, rows, m);
        KMP_BYTES_TAKE(b, misfit, s->model->closure_count);
    }
    for (int r = 0; good && r < m; r++)
        b->failed = b->failed || rows[r].closure < 0 || rows[r].closure >= s->model->closure_count;
    good = good && !b->failed && kmp_system_set_rows(s, n, m, rows, misfit);
    kmp_arena_free(&room);
    return good;
}

static bool read_system(kmp_byte_source *b, kempe_system *s)
{
    if (!take_rows(b, s))
        return false;
    /* Flags. */
    bool none = false, *const flags[] = {&s->rheonomic, &s->switches,         &s->dissipative,
                                         &s->has_power, &s->changes_by_rates, &none};
    for (size_t k = 0; k < sizeof flags / sizeof *flags; k++)
        *flags[k] = kmp_bytes_take_int(b, 0, 1);
    s->dynamics = (kmp_dynamics)kmp_bytes_take_int(b, 0, KMP_DYNAMICS_COUNT - 1);
    atomic_store(&s->rounding->state, none ? KMP_ROUNDING_NONE : KMP_ROUNDING_UNKNOWN);
    take_pattern(b, &s->arena, s->m, s->n, &s->jacobian);
    take_pattern(b, &s->arena, s->n, s->n, &s->mass);
    take_pattern(b, &s->arena, s->n, s->m, &s->load_jacobian);
    s->load_row_count = kmp_bytes_take_count(b, sizeof *s->load_rows);
    s->load_rows = KMP_ARENA_NEW(&s->arena, int, s->m > s->load_row_count ? s->m : s->load_row_count);
    if (s->arena.failed)
        return false;
    KMP_BYTES_TAKE(b, s->load_rows, s->load_row_count);
    take_events(b, s);
    const int waits = kmp_bytes_take_int(b, 0, 2);
    if (waits > 0) {
        s->late = kmp_lazy_equations_new(s);
        if (!s->late)
            return false;
        s->late->by_products = waits > 1;
        kmp_savings_take(b, &s->late->chosen, s->model);
    }
    kmp_savings_take(b, &s->bodies->first, s->model);
    /* Programs. */
    kmp_table_pool pool = {0};
    kmp_program **list[PROGRAMS];
    list_programs(s, list);
    for (int k = 0; k < PROGRAMS; k++)
        *list[k] = kmp_program_get(b, &pool);
    kmp_table_pool_free(&pool);
    name_programs(s);
    const kmp_program *first = s->late ? s->late->weighing : s->motion;
    if (!b->failed && first && s->judge && first->stages > (s->late ? KMP_STAGE_MASS : KMP_STAGE_BIAS))
        s->closing = kmp_program_first(first, KMP_STAGE_MASS);
    return !b->failed && b->at == b->end && s->closing && !s->arena.failed;
}

kempe_system *kmp_system_recall(const kempe_model *model, const char *word)
{
    double begin = kmp_cpu_now();
    kempe_system *s = model->source.has_digest ? kmp_system_start(model) : NULL;
    if (s)
        kmp_program_cache_set_key(s, word);
    kmp_cached file = s ? kmp_program_cache_recall(s, whole) : (kmp_cached){0};
    kmp_byte_source b = kmp_byte_source_of(file.bytes, file.size);
    bool made = file.whole && read_system(&b, s);
    kmp_free(file.whole);
    if (made) {
        s->build_s = kmp_cpu_now() - begin;
        return s;
    }
    kempe_system_free(s);
    return NULL;
}
