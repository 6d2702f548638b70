/* SPDX-License-Identifier: BSD-3-Clause */
/* Sharing of programs and of their forms without locks: a count of users, and a list of forms that only grows, by
 * compare and exchange. A thread that makes a form twice releases its own and takes the earlier one. */
#include "symbolic/program_forms.h"
#include "base/context.h"

kmp_program *kmp_program_share(kmp_program *p)
{
    if (p)
        (void)atomic_fetch_add(&p->shared->others, 1);
    return p;
}

static kmp_program_form *find(kmp_program_form *form, int kind)
{
    while (form && form->kind != kind)
        form = form->next;
    return form;
}

kmp_program_form *kmp_program_find_form(const kmp_program *p, int kind)
{
    return find(atomic_load(&p->shared->first), kind);
}

kmp_program_form *kmp_program_add_form(const kmp_program *p, kmp_program_form *form)
{
    kmp_program_form *first = atomic_load(&p->shared->first);
    do {
        kmp_program_form *earlier = find(first, form->kind);
        if (earlier) {
            form->release(form);
            return earlier;
        }
        form->next = first;
    } while (!atomic_compare_exchange_weak(&p->shared->first, &first, form));
    return form;
}

bool kmp_program_leave(kmp_program *p)
{
    if (p->shared && atomic_fetch_sub(&p->shared->others, 1) > 0)
        return false;
    kmp_program_form *form = p->shared ? atomic_load(&p->shared->first) : NULL;
    while (form) {
        kmp_program_form *next = form->next;
        form->release(form);
        form = next;
    }
    return true;
}

void kmp_program_set_key(kmp_program *p, const kempe_context *context, const kmp_cache_key *key)
{
    p->shared->context = context;
    p->shared->key = *key;
}

const char *kmp_program_folder(const kmp_program *p, int kind, kmp_cache_key *key)
{
    const kmp_program_shared *s = p->shared;
    const char *folder = s->context ? kmp_context_cache(s->context) : NULL;
    kmp_digest digest;
    if (!folder)
        return NULL;
    kmp_digest_begin(&digest);
    kmp_digest_add_part(&digest, s->key.digest, sizeof s->key.digest);
    kmp_digest_add_part(&digest, &kind, sizeof kind);
    kmp_digest_end(&digest, key->digest);
    return folder;
}
