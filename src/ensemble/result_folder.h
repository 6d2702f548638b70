/* SPDX-License-Identifier: BSD-3-Clause */
/* A result folder (kempe/ensemble.h): its manifest, the names of its files, its parts. */
#pragma once

#include "base/arena.h"
#include "base/context.h"
#include "ensemble/batch.h"

/** Ranges of instances, from 0 on. */
typedef struct kmp_instance_ranges {
    int count;
    struct kmp_instance_range {
        int from, to; /* both included */
    } * range;
} kmp_instance_ranges;

struct kempe_folder {
    kempe_context *context;
    kmp_arena arena;
    const char *path;
    const char *manifest;            /* its text */
    const char *model, *file, *hash; /* name of the model, and its file */
    kempe_run_options run;           /* of the manifest */
    int instances, chunk, parts;
    kmp_instance_ranges ranges; /* instances with a history, and the words that choose them */
    const char *history;
    int whole; /* parts that were there when the folder was opened, or when its run ended */
    /* The run that made it, where there was one: */
    bool ran, interrupted, doubted;
    int first, step;                   /* its parts: first, first + step, .. */
    int ran_parts, missing, elsewhere; /* of its parts: run, not whole; of these, the parts in work elsewhere */
    char *warnings;                    /* of its run, one per line */
    kmp_batch_totals totals;
    kmp_instance_causes causes; /* of its instances; after a check, of all */
    double wall_s;
    /* After a check: */
    bool checked;
    int damaged;
    kmp_instance_sums rows;        /* only outcomes and `repeated` */
    kempe_table *shape, *measured; /* columns of the parts; rows of the columns `chosen` that statistics read */
    bool *chosen;
    kempe_statistics *statistics; /* NULL: no quantities, or parts are missing or damaged */
};

/* MOST_PARTS: each is looked for in the file system. */
enum { KMP_HASH_SIZE = 64, KMP_FOLDER_FORMAT = 2, KMP_FOLDER_MOST_PARTS = 1 << 20 };

/** Path of a part, of its histories, of the manifest. */
void kmp_folder_put_part(kmp_text *path, const char *folder, int part);
void kmp_folder_put_history(kmp_text *path, const char *folder, int part);
void kmp_folder_put_manifest(kmp_text *path, const char *folder);

/** True if a part has its final name, and so have its histories if it has chosen instances. */
bool kmp_folder_has_part(const kempe_folder *folder, int part);
/** True if a part has chosen instances. */
bool kmp_folder_wants_history(const kempe_folder *folder, int part);
/** Counts the parts that are there. */
void kmp_folder_count(kempe_folder *folder);
/** Instances of a part, and the number of its first. */
int kmp_folder_part_size(const kempe_folder *folder, int part);

/** Frees what a check has made. */
void kmp_folder_clear(kempe_folder *folder);

/** Size of chunks where the user gives none. */
int kmp_folder_chunk(int instances);

/** A folder with the text of its manifest, which is freed. KEMPE_E_INPUT: it is not one of Kempe, or damaged. */
kempe_status kmp_folder_of(kempe_context *context, const char *path, kmp_text *manifest, kempe_folder **folder);
