/* SPDX-License-Identifier: BSD-3-Clause */
/* A document as text in YAML: mappings by lines, lists of scalars in brackets. */
#include "model/files/yaml.h"
#include <ctype.h>
#include <string.h>

enum { STEP = 2 };

/* True for a scalar that means the same without quotes, in brackets too. */
static bool is_plain(const char *s)
{
    const char *begin = s[0] == '-' || s[0] == '.' ? s + 1 : s;
    bool plain = isalnum((unsigned char)*begin) || *begin == '_';
    for (; *s; s++)
        plain = plain && (isalnum((unsigned char)*s) || strchr("_.+-*/()^<>=", *s) ||
                          (*s == ' ' && isalnum((unsigned char)s[1])));
    return plain;
}

static void put_scalar(kmp_text *text, const kmp_yaml *node)
{
    const char *s = node->text ? node->text : "";
    if (is_plain(s)) {
        kmp_text_put(text, s);
        return;
    }
    kmp_text_put(text, "\"");
    for (; *s; s++)
        if (*s == '"' || *s == '\\')
            kmp_text_printf(text, "\\%c", *s);
        else if ((unsigned char)*s < 0x20)
            kmp_text_printf(text, "\\x%02X", (unsigned)(unsigned char)*s);
        else
            kmp_text_printf(text, "%c", *s);
    kmp_text_put(text, "\"");
}

/* True for a scalar, and for a list of such. */
static bool is_inline(const kmp_yaml *node)
{
    bool fits = node->kind != KMP_YAML_MAP || node->count == 0;
    for (int k = 0; fits && node->kind == KMP_YAML_LIST && k < node->count; k++)
        fits = is_inline(node->items[k]);
    return fits;
}

static void put_inline(kmp_text *text, const kmp_yaml *node)
{
    if (node->kind == KMP_YAML_SCALAR) {
        put_scalar(text, node);
        return;
    }
    const bool list = node->kind == KMP_YAML_LIST;
    kmp_text_put(text, list ? "[" : "{");
    for (int k = 0; k < node->count; k++) {
        kmp_text_put(text, k > 0 ? ", " : "");
        put_inline(text, node->items[k]);
    }
    kmp_text_put(text, list ? "]" : "}");
}

static void put_block(kmp_text *text, const kmp_yaml *node, int indent);

/* After a key and its colon, or the sign of an item. */
static void put_value(kmp_text *text, const kmp_yaml *node, int indent)
{
    if (node->kind == KMP_YAML_SCALAR && node->empty) {
        kmp_text_put(text, "\n");
    } else if (is_inline(node)) {
        kmp_text_put(text, " ");
        put_inline(text, node);
        kmp_text_put(text, "\n");
    } else {
        kmp_text_put(text, "\n");
        put_block(text, node, indent + STEP);
    }
}

static void put_block(kmp_text *text, const kmp_yaml *node, int indent)
{
    for (int k = 0; k < node->count; k++) {
        kmp_text_printf(text, "%*s", indent, "");
        if (node->kind == KMP_YAML_LIST) {
            kmp_text_put(text, "-");
        } else {
            put_scalar(text, node->keys[k]);
            kmp_text_put(text, ":");
        }
        put_value(text, node->items[k], indent);
    }
}

void kmp_yaml_print(kmp_text *text, const kmp_yaml *root)
{
    if (root->kind == KMP_YAML_MAP && root->count > 0)
        put_block(text, root, 0);
    else
        put_value(text, root, 0);
}
