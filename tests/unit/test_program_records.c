/* SPDX-License-Identifier: BSD-3-Clause */
/* Programs that a system keeps for a choice of coordinates: the same one for the same choice, also after the numbers of
 * the model have changed, another one for another choice; and from a cache, equal to the bit. */
#include "base/memory.h"
#include "constraints/programs/program_records.h"
#include "constraints/programs/reduced_program.h"
#include "constraints/programs/saddle_program.h"
#include "loaded.h"
#include "model/data/start.h"
#include "takes_bodies.h"
#include <kempe/cache.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* A choice of a system, with factors at the start. */
typedef struct chosen {
    kmp_evaluator *eval;
    kmp_partition part;
    kmp_reduction red;
} chosen;

/* False: J is singular in the others. `wish`: the independent coordinate; -1: any. */
static bool choose(chosen *c, const loaded *l, int wish)
{
    *c = (chosen){.eval = kmp_eval_new(l->system, "native")};
    double *q = KMP_NEW(double, l->system->n);
    bool ok = c->eval && q;
    for (int i = 0; ok && i < l->system->n; i++)
        q[i] = kmp_model_start(l->model)->q[i].value;
    if (ok)
        kmp_eval_closure(c->eval, 0, q);
    kmp_free(q);
    ok = ok && kmp_partition_init(&c->part, l->system, c->eval->jacobian, &wish, wish >= 0) == KEMPE_OK &&
         kmp_reduction_init(&c->red, c->eval, &c->part) == KEMPE_OK && kmp_reduction_factor(&c->red) == 0;
    CHECK(ok || wish >= 0);
    return ok;
}

static void leave(chosen *c)
{
    kmp_reduction_free(&c->red);
    kmp_partition_free(&c->part);
    kmp_eval_free(c->eval);
}

/* The programs of a choice; their caller's. */
typedef struct written {
    kmp_reduced_program *fused, *reduced;
    kmp_saddle_program *solved;
    kmp_program *nearby;
} written;

static written write_all(const chosen *c)
{
    written w = {0};
    CHECK(kmp_reduced_program_new(&w.fused, &c->red, false) == KEMPE_OK && w.fused);
    CHECK(kmp_saddle_program_new(&w.solved, c->eval, &c->part) == KEMPE_OK && w.solved);
    CHECK(kmp_reduced_program_new_by_saddle(&w.reduced, &c->red, false) == KEMPE_OK && w.reduced);
    CHECK(kmp_saddle_program_write_near(c->eval, &c->part, 1e9, &w.nearby) && w.nearby);
    return w;
}

static void free_all(written *w)
{
    kmp_reduced_program_free(w->fused);
    kmp_saddle_program_free(w->solved);
    kmp_reduced_program_free(w->reduced);
    kmp_program_free(w->nearby);
}

/* True if both have the programs of one writing. */
static bool share(const written *a, const written *b)
{
    return kmp_reduced_program_code(a->fused) == kmp_reduced_program_code(b->fused) &&
           kmp_saddle_program_code(a->solved) == kmp_saddle_program_code(b->solved) &&
           kmp_reduced_program_code(a->reduced) == kmp_reduced_program_code(b->reduced) && a->nearby == b->nearby;
}

static bool are_equal(const written *a, const written *b)
{
    return kmp_program_equal(kmp_reduced_program_code(a->fused), kmp_reduced_program_code(b->fused)) &&
           kmp_program_equal(kmp_saddle_program_code(a->solved), kmp_saddle_program_code(b->solved)) &&
           kmp_program_equal(kmp_reduced_program_code(a->reduced), kmp_reduced_program_code(b->reduced)) &&
           kmp_program_equal(a->nearby, b->nearby) &&
           memcmp(kmp_saddle_program_layout_of(a->solved), kmp_saddle_program_layout_of(b->solved),
                  sizeof(kmp_saddle_program_layout)) == 0 &&
           memcmp(kmp_reduced_program_layout_of(a->reduced), kmp_reduced_program_layout_of(b->reduced),
                  sizeof(kmp_saddle_program_layout)) == 0;
}

/* A later run has the program of the first one. */
static void one_writing_for_a_choice(void)
{
    loaded l = load("examples/andrews/andrews.yaml");
    chosen first, second, other;
    if (!choose(&first, &l, -1) || !choose(&second, &l, -1))
        return;
    written a = write_all(&first), b = write_all(&second);
    CHECK(share(&a, &b));
    free_all(&b);
    CHECK(kmp_system_rescale(l.system));
    b = write_all(&second);
    CHECK(share(&a, &b));
    free_all(&b);
    int others = 0;
    for (int wish = 0; wish < l.system->n; wish++) {
        if (wish != first.part.u[0] && choose(&other, &l, wish)) {
            b = write_all(&other);
            CHECK(kmp_reduced_program_code(a.fused) != kmp_reduced_program_code(b.fused) && !are_equal(&a, &b));
            free_all(&b);
            others++;
        }
        if (wish != first.part.u[0])
            leave(&other);
    }
    CHECK(others > 0);
    free_all(&a);
    leave(&first);
    leave(&second);
    unload(&l);
}

/* All that a program depends on is part of its name. */
static void names(void)
{
    loaded l = load("examples/suspension/suspension.yaml");
    chosen c;
    if (!choose(&c, &l, -1))
        return;
    int *order = KMP_NEW(int, c.part.r + 1);
    for (int i = 0; order && i < c.part.r; i++)
        order[i] = i;
    kmp_program_cache_name name[6] = {kmp_writer_name("fused", c.eval, &c.part, NULL, 0)};
    name[1] = kmp_writer_name("fused", c.eval, &c.part, NULL, 1);
    name[2] = kmp_writer_name("fused", c.eval, &c.part, order, 0);
    kmp_swap_int(&order[0], &order[1]);
    name[3] = kmp_writer_name("fused", c.eval, &c.part, order, 0);
    CHECK(kmp_eval_add_articulated(c.eval) == KEMPE_OK && takes_bodies(l.system));
    kmp_eval_set_by_bodies(c.eval, true);
    name[4] = kmp_writer_name("fused", c.eval, &c.part, NULL, 0);
    kmp_swap_int(&c.part.rows[0], &c.part.rows[1]);
    name[5] = kmp_writer_name("fused", c.eval, &c.part, NULL, 0);
    for (int k = 0; k < 6; k++)
        for (int j = 0; j < k; j++)
            CHECK(name[j].variant != name[k].variant ||
                  memcmp(&name[j].choice, &name[k].choice, sizeof name[k].choice) != 0);
    kmp_free(order);
    leave(&c);
    unload(&l);
}

static char folder[] = "/tmp/kempe_test_written_XXXXXX";

static loaded load_cached(const char *path)
{
    char full[1024];
    loaded l = {.context = kempe_context_new()};
    CHECK(kempe_context_set_cache(l.context, folder) == KEMPE_OK);
    (void)snprintf(full, sizeof full, "%s/%s", KEMPE_ROOT, path);
    (void)kempe_model_read(l.context, full, &l.model);
    return load_finish(l);
}

static bool is_in_cache(const loaded *l, const chosen *c, unsigned run)
{
    kmp_program_record record = {0};
    bool found = kmp_writer_recall(l->system, kmp_writer_name("nearby", c->eval, &c->part, NULL, run), &record);
    kmp_program_free(record.program);
    kmp_free(record.row);
    return found;
}

/* More choices than a system keeps: the programs are written, but the last ones end with their users, and have no file.
 */
static void many_choices(void)
{
    loaded l = load_cached("examples/four_bar/four_bar.yaml"), later = load_cached("examples/four_bar/four_bar.yaml");
    chosen c, same;
    if (!choose(&c, &l, -1) || !choose(&same, &later, -1))
        return;
    for (int k = 0; k < KMP_KEPT_CHOICES + 4; k++) {
        kmp_program *one = NULL, *two = NULL;
        double run = 1e6 + k;
        CHECK(kmp_saddle_program_write_near(c.eval, &c.part, run, &one) &&
              kmp_saddle_program_write_near(c.eval, &c.part, run, &two));
        CHECK(one && two && kmp_program_equal(one, two) && (one == two) == (k < KMP_KEPT_CHOICES));
        kmp_program_free(one);
        kmp_program_free(two);
    }
    CHECK(is_in_cache(&later, &same, 1000000 + KMP_KEPT_CHOICES - 1));
    CHECK(!is_in_cache(&later, &same, 1000000 + KMP_KEPT_CHOICES));
    leave(&c);
    leave(&same);
    unload(&l);
    unload(&later);
}

/* Another process takes the files. */
static void from_a_cache(void)
{
    static const char *const paths[] = {"examples/andrews/andrews.yaml", "examples/stewart/stewart.yaml"};
    for (size_t k = 0; k < sizeof paths / sizeof *paths; k++) {
        loaded writer = load_cached(paths[k]), reader = load_cached(paths[k]), alone = load(paths[k]);
        chosen first, second, third;
        if (!choose(&first, &writer, -1) || !choose(&second, &reader, -1) || !choose(&third, &alone, -1))
            return;
        written a = write_all(&first);
        const kmp_program_cache_name name = kmp_writer_name("nearby", second.eval, &second.part, NULL, 1000000000);
        kmp_program_record record = {0};
        CHECK(!kmp_program_cache_find(reader.system, name) && kmp_writer_recall(reader.system, name, &record));
        CHECK(kmp_program_equal(record.program, a.nearby));
        kmp_program_free(record.program);
        kmp_free(record.row);
        CHECK(!kmp_writer_recall(alone.system, name, &record));
        written b = write_all(&second), c = write_all(&third);
        CHECK(are_equal(&a, &b) && are_equal(&a, &c) && !share(&a, &b));
        free_all(&a);
        free_all(&b);
        free_all(&c);
        leave(&first);
        leave(&second);
        leave(&third);
        unload(&writer);
        unload(&reader);
        unload(&alone);
    }
}

int main(void)
{
    char clean[64];
    CHECK(mkdtemp(folder));
    TEST(one_writing_for_a_choice);
    TEST(names);
    TEST(many_choices);
    TEST(from_a_cache);
    (void)snprintf(clean, sizeof clean, "rm -rf %s", folder);
    CHECK(system(clean) == 0);
    return check_report();
}
