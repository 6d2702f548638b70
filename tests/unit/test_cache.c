/* SPDX-License-Identifier: BSD-3-Clause */
/* wings: rail */
/* Digests, programs as bytes, and systems from a cache. Damaged files and several processes:
 * tests/cache_folders.py. */
#include "base/cache/digest.h"
#include "dynamics/motion.h"
#include "dynamics/system_record.h"
#include "loaded.h"
#include "model/data/model.h"
#include "model/data/variant.h"
#include "symbolic/program_bytes.h"
#include "takes_bodies.h"
#include <dirent.h>
#include <kempe/cache.h>
#include <stdlib.h>
#include <unistd.h>

static char folder[] = "/tmp/kempe_test_cache_XXXXXX";

/* The results in the folder; removes all files if asked. */
static int count_files(bool remove_them)
{
    char path[1024];
    int count = 0;
    DIR *d = opendir(folder);
    for (const struct dirent *e = d ? readdir(d) : NULL; e; e = readdir(d)) {
        bool file = e->d_name[0] != '.';
        count += file && strcmp(e->d_name, "counted") != 0;
        (void)snprintf(path, sizeof path, "%s/%s", folder, e->d_name);
        if (file && remove_them)
            (void)unlink(path);
    }
    if (d)
        closedir(d);
    return count;
}

/* -- digests ----------------------------------------------------------------------------------------- */

static bool has_digest(const char *text, size_t times, size_t part, const char *expected)
{
    unsigned char out[KMP_DIGEST_SIZE];
    char hex[2 * KMP_DIGEST_SIZE + 1];
    kmp_digest d;
    kmp_digest_begin(&d);
    for (size_t k = 0; k < times; k++)
        for (size_t at = 0, size = strlen(text); at < size; at += part)
            kmp_digest_add(&d, text + at, size - at < part ? size - at : part);
    kmp_digest_end(&d, out);
    for (size_t k = 0; k < KMP_DIGEST_SIZE; k++)
        (void)snprintf(hex + 2 * k, 3, "%02x", out[k]);
    return strcmp(hex, expected) == 0;
}

/* The examples of FIPS 180-4. */
static void known_digests(void)
{
    const char *long_text = "abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq";
    CHECK(has_digest("", 1, 1, "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855"));
    CHECK(has_digest("abc", 1, 3, "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"));
    for (size_t part = 1; part < 60; part += 7)
        CHECK(has_digest(long_text, 1, part, "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1"));
    CHECK(has_digest("aaaaaaaaaa", 100000, 7, "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0"));
}

static void every_changed_byte_is_seen(void)
{
    unsigned char bytes[200] = {0};
    for (size_t k = 0; k < sizeof bytes; k++)
        bytes[k] = (unsigned char)(k * k);
    for (size_t size = 0; size < sizeof bytes; size++) {
        uint64_t sum = kmp_checksum(bytes, size);
        CHECK(kmp_checksum(bytes, size + 1) != sum);
        for (size_t k = 0; k < size; k++) {
            bytes[k] ^= (unsigned char)(1 << k % 8);
            CHECK(kmp_checksum(bytes, size) != sum);
            bytes[k] ^= (unsigned char)(1 << k % 8);
        }
    }
}

/* -- systems ----------------------------------------------------------------------------------------- */

static loaded load_cached(const char *path, const char *cache)
{
    char full[1024];
    loaded l = {.context = kempe_context_new()};
    (void)snprintf(full, sizeof full, "%s/%s", KEMPE_ROOT, path);
    CHECK(kempe_context_set_cache(l.context, cache) == KEMPE_OK);
    CHECK(kempe_model_read(l.context, full, &l.model) == KEMPE_OK);
    return load_finish(l);
}

static bool same_program(const kmp_program *a, const kmp_program *b)
{
    kmp_text x = {0}, y = {0};
    if (!a || !b)
        return a == b;
    kmp_program_print(a, NULL, &x);
    kmp_program_print(b, NULL, &y);
    bool same = x.s && y.s && strcmp(x.s, y.s) == 0 && a->graph_nodes == b->graph_nodes;
    kmp_text_free(&x);
    kmp_text_free(&y);
    return same;
}

static bool same_pattern(const kmp_pattern *a, const kmp_pattern *b)
{
    bool same = a->count == b->count;
    for (int k = 0; same && k < a->count; k++)
        same = a->row[k] == b->row[k] && a->col[k] == b->col[k];
    return same;
}

static void check_same(const kempe_system *a, const kempe_system *b)
{
    CHECK(a->n == b->n && a->m == b->m && a->dynamics == b->dynamics && a->length == b->length);
    CHECK(a->reach == b->reach && a->closure_tolerance == b->closure_tolerance && a->strict == b->strict);
    CHECK(!a->late == !b->late && kmp_motion_need(a) == KEMPE_OK && kmp_motion_need(b) == KEMPE_OK);
    CHECK(!a->late || same_program(a->late->weighing, b->late->weighing));
    CHECK(takes_bodies(a) == takes_bodies(b) && same_program(a->bodies->program, b->bodies->program));
    CHECK(same_program(a->motion, b->motion) && same_program(a->closing, b->closing));
    CHECK(same_program(a->judge, b->judge));
    CHECK(same_program(a->changes, b->changes) && same_program(a->goals, b->goals));
    CHECK(same_pattern(&a->jacobian, &b->jacobian) && same_pattern(&a->mass, &b->mass));
    CHECK(same_pattern(&a->load_jacobian, &b->load_jacobian));
    CHECK(a->load_row_count == b->load_row_count);
    CHECK(a->rheonomic == b->rheonomic && a->switches == b->switches && a->dissipative == b->dissipative);
    CHECK(a->has_power == b->has_power && a->changes_by_rates == b->changes_by_rates);
    CHECK(atomic_load(&a->rounding->state) == atomic_load(&b->rounding->state));
    CHECK(a->chart_count == b->chart_count && a->events.count == b->events.count);
    for (int k = 0; k < a->events.count && k < b->events.count; k++) {
        const kmp_condition *x = &a->events.condition[k], *y = &b->events.condition[k];
        CHECK(x->number == y->number && x->ends == y->ends && x->kink == y->kink && x->late == y->late);
        CHECK(x->lag == y->lag && !x->expr == !y->expr && !x->advice == !y->advice);
        CHECK_TEXT(a->event_text[k], b->event_text[k]);
    }
    for (int r = 0; r < a->m; r++)
        CHECK_TEXT(a->row_names[r], b->row_names[r]);
}

static void compare(const char *path)
{
    loaded fresh = load_cached(path, NULL), cold = load_cached(path, folder), warm = load_cached(path, folder);
    kempe_system *recalled = warm.model ? kmp_system_recall(warm.model, NULL) : NULL;
    CHECK(recalled);
    if (fresh.system && cold.system && warm.system && recalled) {
        check_same(fresh.system, cold.system);
        check_same(fresh.system, warm.system);
        check_same(fresh.system, recalled);
    }
    kempe_system_free(recalled);
    unload(&fresh);
    unload(&cold);
    unload(&warm);
}

/* Places of objects in an arena of many blocks, as they are recorded: the same in another one that is filled so. */
static void places_in_arenas(void)
{
    enum { COUNT = 3000 };
    kmp_arena one = {0}, other = {0};
    static int *first[COUNT], *second[COUNT];
    for (int k = 0; k < COUNT; k++) {
        first[k] = KMP_ARENA_NEW(&one, int, 1 + k % 700);
        second[k] = KMP_ARENA_NEW(&other, int, 1 + k % 700);
    }
    int blocks = 0;
    for (int k = 0; k < COUNT; k++) {
        kmp_arena_spot spot;
        CHECK(kmp_arena_find(&one, first[k], &spot) && kmp_arena_at(&one, spot, sizeof(int)) == first[k]);
        CHECK(kmp_arena_at(&other, spot, sizeof(int)) == second[k]);
        blocks = spot.block + 1;
    }
    CHECK(blocks > 5 && kmp_arena_shape(&one) == kmp_arena_shape(&other));
    CHECK(!kmp_arena_at(&one, (kmp_arena_spot){blocks, 0}, 1) && !kmp_arena_at(&one, (kmp_arena_spot){0, 1 << 20}, 1));
    kmp_arena_spot none;
    CHECK(!kmp_arena_find(&one, &blocks, &none));
    kmp_arena_free(&one);
    kmp_arena_free(&other);
}

static void systems_are_the_same(void)
{
    static const char *const paths[] = {"examples/andrews/andrews.yaml",
                                        "examples/governor/governor.yaml",
                                        "examples/rolling_wheel/rolling_wheel.yaml",
                                        "examples/wheelset/wheelset.yaml",
                                        "examples/limousine/limousine.yaml",
                                        "examples/coupler_fit/coupler_fit.yaml",
                                        "examples/bogie_track/bogie_track.yaml",
                                        "tests/models/three_bogies.yaml"};
    for (size_t k = 0; k < sizeof paths / sizeof *paths; k++)
        compare(paths[k]);
    /* systems, and their articulated bodies or none; of the last one M and C apart */
    CHECK(count_files(true) == 2 * sizeof paths / sizeof *paths + 1);
}

/* The library writes no file unless it is asked to. A variant's numbers are not those of the files. */
static void nothing_is_written_unasked(void)
{
    loaded l = load_cached("examples/four_bar/four_bar.yaml", folder);
    kmp_variant *variant = NULL;
    kempe_system *system = NULL;
    CHECK(l.model->source.has_digest && count_files(true) == 1);
    CHECK(kmp_variant_new(l.model, 0, NULL, &variant) == KEMPE_OK && !kmp_variant_model(variant)->source.has_digest);
    CHECK(kempe_system_new(kmp_variant_model(variant), &system) == KEMPE_OK && !system->has_key);
    kempe_system_free(system);
    kmp_variant_free(variant);
    unload(&l);
    l = load("examples/four_bar/four_bar.yaml");
    CHECK(count_files(false) == 0);
    unload(&l);
}

/* Bytes that end early or are changed give no program, or one whose operands exist. */
static void damaged_programs(void)
{
    loaded l = load("examples/rolling_wheel/rolling_wheel.yaml");
    kmp_bytes b = {0};
    kmp_table_pool pool = {0};
    kmp_program_put(&b, &pool, l.system->motion);
    kmp_table_pool_free(&pool);
    CHECK(!b.failed && b.size > 1000);
    for (size_t size = 0, step = b.size / 300 + 1; size < b.size; size += step) {
        kmp_byte_source s = kmp_byte_source_of(b.at, size);
        CHECK(!kmp_program_get(&s, &pool) && s.failed);
        kmp_table_pool_free(&pool);
    }
    for (size_t at = 0, step = b.size / 1000 + 1; at < b.size; at += step) {
        b.at[at] ^= 0xff;
        kmp_byte_source s = kmp_byte_source_of(b.at, b.size);
        kmp_program *p = kmp_program_get(&s, &pool);
        CHECK(p || s.failed);
        kmp_program_free(p);
        kmp_table_pool_free(&pool);
        b.at[at] ^= 0xff;
    }
    kmp_bytes_free(&b);
    unload(&l);
}

static void check_folder(const char *cache, const char *xdg, const char *home, const char *expected)
{
    const char *const names[] = {"KEMPE_CACHE", "XDG_CACHE_HOME", "HOME"}, *const values[] = {cache, xdg, home};
    for (size_t k = 0; k < 3; k++)
        CHECK((values[k] ? setenv(names[k], values[k], 1) : unsetenv(names[k])) == 0);
    char *found = kempe_cache_folder();
    CHECK_TEXT(found ? found : "none", expected ? expected : "none");
    kempe_text_free(found);
}

static void folders(void)
{
    check_folder("/a", "/b", "/c", "/a");
    check_folder("off", "/b", "/c", NULL);
    check_folder(NULL, "/b", "/c", "/b/kempe");
    check_folder("", "relative", "/c", "/c/.cache/kempe");
    check_folder(NULL, NULL, "/c", "/c/.cache/kempe");
    check_folder(NULL, NULL, NULL, NULL);
}

int main(void)
{
    CHECK(mkdtemp(folder));
    TEST(known_digests);
    TEST(every_changed_byte_is_seen);
    TEST(places_in_arenas);
    TEST(systems_are_the_same);
    TEST(nothing_is_written_unasked);
    TEST(damaged_programs);
    TEST(folders);
    (void)count_files(true);
    CHECK(rmdir(folder) == 0);
    return check_report();
}
