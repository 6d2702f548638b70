/* SPDX-License-Identifier: BSD-3-Clause */
/* A list of derived programs of a system under a lock, and their keys on disk. A key is a digest of the build, of the
 * model's bytes and of the algorithm, so that a file can be stale but not wrong. Programs for a choice of coordinates
 * are kept up to a number of choices. */
#include "dynamics/program_cache.h"
#include "base/cache/cache_files.h"
#include "base/context.h"
#include "base/memory.h"
#include "model/data/model.h"
#include "symbolic/program_forms.h"
#include <pthread.h>
#include <string.h>

typedef struct item {
    struct item *next;
    kmp_program_cache_name name; /* its word is a literal */
    void *made;
    void (*release)(void *made);
} item;

struct kmp_program_cache {
    pthread_mutex_t lock;
    item *first;
    int choices;
};

kmp_program_cache *kmp_program_cache_new(void)
{
    kmp_program_cache *kept = KMP_NEW(kmp_program_cache, 1);
    if (kept && pthread_mutex_init(&kept->lock, NULL) != 0) {
        kmp_free(kept);
        return NULL;
    }
    return kept;
}

static bool has_choice(const kmp_program_cache_name *name)
{
    static const kmp_cache_key none;
    return memcmp(&name->choice, &none, sizeof none) != 0;
}

static void clear(kmp_program_cache *kept, bool all)
{
    for (item **place = &kept->first, *x; (x = *place);) {
        if (!all && has_choice(&x->name)) {
            place = &x->next;
            continue;
        }
        *place = x->next;
        x->release(x->made);
        kmp_free(x);
    }
}

void kmp_program_cache_clear(kmp_program_cache *kept)
{
    clear(kept, false);
}

void kmp_program_cache_free(kmp_program_cache *kept)
{
    if (!kept)
        return;
    clear(kept, true);
    pthread_mutex_destroy(&kept->lock);
    kmp_free(kept);
}

/* -- keys -------------------------------------------------------------------------------------------- */

void kmp_program_cache_set_key(kempe_system *s, const char *algorithm)
{
    static const char format[] = "system 4"; /* of the bytes of all parts: changes with them */
    const kempe_model *model = s->model;
    kmp_digest digest;
    kmp_digest_begin(&digest);
    s->has_key = model->source.has_digest && kmp_context_cache(s->context) && kmp_cache_add_build(&digest);
    if (!s->has_key)
        return;
    kmp_digest_add_text(&digest, format);
    kmp_digest_add_text(&digest, kempe_version());
    kmp_digest_add_part(&digest, model->source.digest, sizeof model->source.digest);
    const size_t shape = kmp_arena_shape(&model->arena); /* conditions are kept by their places: paths are in between */
    kmp_digest_add_part(&digest, &shape, sizeof shape);
    kmp_digest_add_part(&digest, &model->closure_tolerance.value, sizeof(double));
    kmp_digest_add_part(&digest, &model->closure_tolerance_given, sizeof(bool));
    kmp_digest_add_text(&digest, algorithm);
    kmp_digest_end(&digest, s->key);
}

static kmp_cache_key key_of(const kempe_system *s, kmp_program_cache_name name)
{
    kmp_cache_key key;
    kmp_digest digest;
    kmp_digest_begin(&digest);
    kmp_digest_add_part(&digest, s->key, sizeof s->key);
    kmp_digest_add_text(&digest, name.what);
    kmp_digest_add_part(&digest, &name.variant, sizeof name.variant);
    kmp_digest_add_part(&digest, name.choice.digest, sizeof name.choice.digest);
    kmp_digest_end(&digest, key.digest);
    return key;
}

kmp_cached kmp_program_cache_recall(const kempe_system *s, kmp_program_cache_name name)
{
    const char *folder = s->has_key ? kmp_context_cache(s->context) : NULL;
    const kmp_cache_key key = folder ? key_of(s, name) : (kmp_cache_key){{0}};
    return folder ? kmp_cache_read(folder, &key) : (kmp_cached){0};
}

void kmp_program_cache_write(const kempe_system *s, kmp_program_cache_name name, const kmp_bytes *bytes)
{
    const char *folder = s->has_key ? kmp_context_cache(s->context) : NULL;
    if (!folder || bytes->failed)
        return;
    const kmp_cache_key key = key_of(s, name);
    kmp_cache_write(folder, &key, bytes->at, bytes->size, KMP_CACHE_BYTES);
}

void kmp_program_cache_name_program(const kempe_system *s, kmp_program_cache_name name, kmp_program *program)
{
    if (!s->has_key || !program)
        return;
    const kmp_cache_key key = key_of(s, name);
    kmp_program_set_key(program, s->context, &key);
}

/* -- items ------------------------------------------------------------------------------------------- */

static item *find(const kmp_program_cache *kept, kmp_program_cache_name name)
{
    item *x = kept->first;
    while (x && (x->name.variant != name.variant || memcmp(&x->name.choice, &name.choice, sizeof name.choice) != 0 ||
                 strcmp(x->name.what, name.what) != 0))
        x = x->next;
    return x;
}

const void *kmp_program_cache_find(const kempe_system *s, kmp_program_cache_name name)
{
    pthread_mutex_lock(&s->kept->lock);
    const item *x = find(s->kept, name);
    pthread_mutex_unlock(&s->kept->lock);
    return x ? x->made : NULL;
}

bool kmp_program_cache_has_room(const kempe_system *s)
{
    pthread_mutex_lock(&s->kept->lock);
    bool room = s->kept->choices < KMP_KEPT_CHOICES;
    pthread_mutex_unlock(&s->kept->lock);
    return room;
}

const void *kmp_program_cache_add(const kempe_system *s, kmp_program_cache_name name, void *made,
                                  void (*release)(void *made))
{
    kmp_program_cache *kept = s->kept;
    item *new = KMP_NEW(item, 1);
    bool chosen = has_choice(&name);
    pthread_mutex_lock(&kept->lock);
    item *x = find(kept, name);
    bool added = !x && new && !(chosen && kept->choices == KMP_KEPT_CHOICES);
    if (added) {
        kept->choices += chosen;
        *new = (item){kept->first, name, made, release};
        kept->first = x = new;
    }
    pthread_mutex_unlock(&kept->lock);
    if (!added) {
        kmp_free(new);
        release(made);
    }
    return x ? x->made : NULL;
}
