/* SPDX-License-Identifier: BSD-3-Clause */
/* wings: exchange */
/* Layout and machine code made once for all machines of a program: each has values of its own and the bits of the tape,
 * in several threads too; as bytes they are the same again, and damaged bytes are refused. Tapes likewise; and code
 * that is written when it pays. */
#include "backend/lanes.h"
#include "backend/native.h"
#include "backend/prepared.h"
#include "dynamics/system.h"
#include "loaded.h"
#include <kempe/check.h>
#include <math.h>
#include <pthread.h>

enum { MACHINES = 4, STAGE = KMP_STAGE_BIAS };

static const char *const path = "examples/bogie/bogie.yaml";
static const char *const divided = "examples/curving/curving.yaml"; /* its bias is worth several threads */

static double base[2][128];  /* q and qd near which states are */
static double around = 0.01; /* how near */

/* Takes the assembled start, at which wheels are on their rails. */
static void take_base(const loaded *l)
{
    kempe_assembly *a = NULL;
    around = 1e-5;
    CHECK(l->system->n <= 128 && kempe_assembly_new(l->system, &a) == KEMPE_OK);
    for (int k = 0; a && k < l->system->n; k++) {
        base[0][k] = kempe_assembly_q(a)[k];
        base[1][k] = kempe_assembly_qd(a)[k];
    }
    kempe_assembly_free(a);
}

/* Runs all stages at a state that depends on `seed`; the outputs of the last one. */
static const double *run(const loaded *l, kmp_machine *m, int seed)
{
    static const double none[128] = {0};
    double q[128], qd[128], chart[9 * 128], t = 0.1 * seed;
    for (int k = 0; k < 9 * 128; k++)
        chart[k] = k % 9 % 4 == 0; /* C = 1 */
    for (int k = 0; k < 128; k++) {
        q[k] = base[0][k] + around * ((seed + k) % 7);
        qd[k] = base[1][k] + 10 * around * ((2 * seed + k) % 5);
    }
    kmp_machine_set(m, KMP_IN_PARAMETER, l->system->parameters);
    kmp_machine_set(m, KMP_IN_TIME, &t);
    kmp_machine_set(m, KMP_IN_Q, q);
    kmp_machine_set(m, KMP_IN_QD, qd);
    kmp_machine_set(m, KMP_IN_CHART, chart);
    kmp_machine_set(m, KMP_IN_LAMBDA, none);
    kmp_machine_set(m, KMP_IN_MODE, none);
    for (int s = 0; s < STAGE; s++)
        (void)kmp_machine_run(m, s);
    return kmp_machine_run(m, STAGE);
}

static int outputs_of(const kmp_program *p)
{
    return p->outputs[STAGE + 1] - p->outputs[STAGE];
}

/* A program of its own, so that nothing of it is prepared. */
static kmp_program *fresh(const loaded *l)
{
    kmp_program *p = kmp_program_copy(l->system->motion);
    CHECK(p && !kmp_program_find_form(p, KMP_CODE_ONE));
    return p;
}

static bool has_bits(const loaded *l, const kmp_program *p, kmp_machine *m, int seed)
{
    kmp_machine *tape = kmp_machine_new(p, &kmp_backend_tape);
    const double *expected = run(l, tape, seed), *out = run(l, m, seed);
    bool same = memcmp(out, expected, (size_t)outputs_of(p) * sizeof *out) == 0;
    for (int k = 0; k < outputs_of(p); k++)
        same = same && isfinite(out[k]);
    kmp_machine_free(tape);
    return same;
}

static void machines_share_code(void)
{
    loaded l = load(path);
    kmp_program *p = fresh(&l);
    kmp_machine *m[MACHINES];
    for (int k = 0; k < MACHINES; k++)
        m[k] = kmp_machine_new(p, &kmp_backend_native);
    const kmp_program_form *form = kmp_program_find_form(p, KMP_CODE_ONE);
    CHECK(!form == !kmp_code_runs(KMP_CODE_ONE));
    CHECK(!form || form == &kmp_prepared_of(p, KMP_CODE_ONE, 0)->form);
    for (int k = 0; k < MACHINES; k++) /* what others ran before does not matter */
        CHECK(has_bits(&l, p, m[k], k));
    kmp_machine_free(m[0]);
    CHECK(has_bits(&l, p, m[1], 0));
    for (int k = 1; k < MACHINES; k++)
        kmp_machine_free(m[k]);
    kmp_program_free(p);
    unload(&l);
}

/* A holder may leave before the others. */
static void programs_have_holders(void)
{
    loaded l = load(path);
    kmp_program *p = fresh(&l), *again = kmp_program_share(p);
    kmp_machine *m = kmp_machine_new(again, &kmp_backend_native);
    CHECK(again == p);
    kmp_program_free(p);
    CHECK(has_bits(&l, again, m, 3));
    kmp_machine_free(m);
    kmp_program_free(again);
    unload(&l);
}

typedef struct work {
    const loaded *l;
    const kmp_program *p;
    int seed;
    bool good;
} work;

static void *work_on(void *self)
{
    work *w = self;
    kmp_machine *m = kmp_machine_new(w->p, &kmp_backend_native);
    w->good = m && has_bits(w->l, w->p, m, w->seed);
    kmp_machine_free(m);
    return NULL;
}

static void threads_share_code(void)
{
    loaded l = load(path);
    kmp_program *p = fresh(&l);
    pthread_t thread[MACHINES];
    work w[MACHINES];
    for (int k = 0; k < MACHINES; k++) {
        w[k] = (work){&l, p, k, false};
        CHECK(pthread_create(&thread[k], NULL, work_on, &w[k]) == 0);
    }
    for (int k = 0; k < MACHINES; k++) {
        CHECK(pthread_join(thread[k], NULL) == 0);
        CHECK(w[k].good);
    }
    kmp_program_free(p);
    unload(&l);
}

/* -- tapes, and code that is written when it pays ------------------------------------------------------ */

/* Tapes share their records, not their values. */
static void machines_share_a_tape(void)
{
    loaded l = load(path);
    kmp_program *p = kmp_program_copy(l.system->motion);
    kmp_machine *m[MACHINES];
    for (int k = 0; k < MACHINES; k++)
        m[k] = kmp_machine_new(p, &kmp_backend_tape);
    const double *held = run(&l, m[0], 1), *other = run(&l, m[1], 2);
    CHECK(held != other && memcmp(held, other, (size_t)outputs_of(p) * sizeof *held) != 0);
    kmp_machine *alone = kmp_machine_new(p, &kmp_backend_tape);
    CHECK(memcmp(held, run(&l, alone, 1), (size_t)outputs_of(p) * sizeof *held) == 0);
    kmp_machine_free(alone);
    kmp_machine *native = kmp_machine_new(p, &kmp_backend_native);
    for (int k = 0; k < MACHINES; k++)
        CHECK(has_bits(&l, p, native, k) && has_bits(&l, p, m[k], k));
    for (int k = 0; k < MACHINES; k++)
        kmp_machine_free(m[k]);
    kmp_machine_free(native);
    kmp_program_free(p);
    unload(&l);
}

/* The number of runs after which a machine of `waiting` has written code; 0: not within `most`. Its outputs are those
 * of the tape before and after, also from a stage whose earlier stages ran before the change. */
static int runs_until_code(const loaded *l, const kmp_program *p, int most)
{
    kmp_machine *m = kmp_machine_new(p, kmp_backend_waiting(&kmp_backend_native));
    int found = 0;
    for (int k = 0; k < most && !found; k++) {
        CHECK(has_bits(l, p, m, k));
        found = kmp_program_find_form(p, KMP_CODE_ONE) ? k + 1 : 0;
    }
    for (int k = 0; k < 3; k++)
        CHECK(has_bits(l, p, m, k));
    kmp_machine_free(m);
    return found;
}

static void code_is_written_when_it_pays(void)
{
    loaded small = load("examples/andrews/andrews.yaml"), large = load("examples/suspension/suspension.yaml");
    kmp_program *of_small = fresh(&small), *of_large = fresh(&large);
    bool runs = kmp_code_runs(KMP_CODE_ONE);
    CHECK(runs_until_code(&small, of_small, 1) == (runs ? 1 : 0));
    int count = runs_until_code(&large, of_large, 1000);
    printf("   code of %d operations after %d runs\n", of_large->code[of_large->stages], count);
    CHECK(runs ? count > 100 && count < 400 : count == 0);
    CHECK(runs_until_code(&large, of_large, 1) == (runs ? 1 : 0)); /* another machine has it at once */
    CHECK(kmp_backend_waiting(&kmp_backend_tape) == &kmp_backend_tape);
    kmp_program_free(of_small);
    kmp_program_free(of_large);
    unload(&small);
    unload(&large);
}

/* -- bytes ------------------------------------------------------------------------------------------- */

/* A form of a program: in one part, or in parts for threads. */
typedef struct shape {
    kmp_code_form form;
    int threads;
} shape;

static void put(const kmp_program *p, shape of, kmp_bytes *b)
{
    /* the form belongs to the program, which is not frozen here */
    const kmp_prepared *made = kmp_prepared_of(p, of.form, of.threads);
    int kind = made ? kmp_prepared_kind(of.form, of.threads) : -1;
    kmp_prepared_put(b, (kmp_prepared *)kmp_program_find_form(p, kind));
    CHECK(!b->failed && b->size > 1000);
}

static void release(kmp_program_form *form)
{
    kmp_prepared *prepared = (kmp_prepared *)form;
    kmp_frame_free(&prepared->frame);
    kmp_code_free(&prepared->code);
}

/* Takes the bytes for the program; false: they are refused. */
static bool take(const kmp_bytes *b, const kmp_program *p, shape of, kmp_prepared *taken)
{
    kmp_byte_source s = kmp_byte_source_of(b->at, b->size);
    *taken = (kmp_prepared){.form = {.kind = kmp_prepared_kind(of.form, of.threads), .release = release}};
    if (kmp_prepared_take(&s, p, taken))
        return true;
    release(&taken->form);
    return false;
}

/* A machine of the form, in parts by a thread pool. */
static void runs_alike(const loaded *l, const kmp_program *p, int threads)
{
    kmp_team *team = threads > 0 ? kmp_team_new(threads) : NULL;
    kmp_backend backend = kmp_backend_native;
    backend.team = team;
    kmp_machine *m = kmp_machine_new(p, &backend);
    CHECK(m && has_bits(l, p, m, 5));
    kmp_machine_free(m);
    kmp_team_free(team);
}

static void check_bytes(const loaded *l, shape of)
{
    kmp_program *p = fresh(l), *other = fresh(l);
    kmp_prepared taken;
    kmp_bytes b = {0}, again = {0};
    if (kmp_code_runs(of.form)) {
        put(p, of, &b);
        CHECK(take(&b, other, of, &taken));
        CHECK((kmp_frame_parts(&taken.frame, STAGE) > 1) == (of.threads > 0));
        kmp_prepared_put(&again, &taken);
        CHECK(again.size == b.size && memcmp(again.at, b.at, b.size) == 0);
        CHECK(kmp_program_add_form(other, &taken.form) == &taken.form);
        runs_alike(l, other, of.threads);
    }
    kmp_bytes_free(&b);
    kmp_bytes_free(&again);
    kmp_program_free(p);
    kmp_program_free(other);
}

static void bytes_are_the_same(void)
{
    loaded l = load(path), wagon = load(divided);
    for (const kmp_code_form *form = kmp_encoder_here()->forms; *form; form++)
        check_bytes(&l, (shape){*form, 0});
    take_base(&wagon);
    for (int threads = 2; threads < 5; threads++)
        check_bytes(&wagon, (shape){KMP_CODE_ONE, threads});
    unload(&l);
    unload(&wagon);
}

/* Places that the C code reads are checked; machine code is checked by the checksum of its file only. */
static void check_damage(const loaded *l, shape of)
{
    kmp_program *p = fresh(l);
    kmp_prepared taken;
    kmp_bytes b = {0};
    put(p, of, &b);
    for (size_t size = 0, whole = b.size, step = whole / 100; size < whole; size += step) {
        b.size = size;
        CHECK(!take(&b, p, of, &taken));
        b.size = whole;
    }
    for (size_t at = 12; at < 56; at++) { /* counts of arrays */
        b.at[at] ^= 0x20;
        CHECK(!take(&b, p, of, &taken));
        b.at[at] ^= 0x20;
    }
    for (size_t at = 0, step = b.size / 2000 + 1; at < b.size; at += step) { /* refused, or of no harm */
        b.at[at] ^= 0xff;
        if (take(&b, p, of, &taken))
            release(&taken.form);
        b.at[at] ^= 0xff;
    }
    CHECK(!take(&b, l->system->judge, of, &taken));
    CHECK(!take(&b, p, (shape){KMP_CODE_FOUR, of.threads}, &taken));
    CHECK(!take(&b, p, (shape){of.form, of.threads + 2}, &taken));
    kmp_bytes_free(&b);
    kmp_program_free(p);
}

static void damaged_bytes_are_refused(void)
{
    loaded l = load(path), wagon = load(divided);
    if (kmp_code_runs(KMP_CODE_ONE)) {
        check_damage(&l, (shape){KMP_CODE_ONE, 0});
        check_damage(&wagon, (shape){KMP_CODE_ONE, 2});
    }
    unload(&l);
    unload(&wagon);
}

int main(void)
{
    TEST(machines_share_code);
    TEST(programs_have_holders);
    TEST(threads_share_code);
    TEST(machines_share_a_tape);
    TEST(code_is_written_when_it_pays);
    TEST(bytes_are_the_same);
    TEST(damaged_bytes_are_refused);
    return check_report();
}
