/* SPDX-License-Identifier: BSD-3-Clause */
/* Roads and tyres as the reader understood them, in both forms. The object of a tyre has all numbers of its equations.
 */
#include "road/model/write_tyres.h"
#include "base/text.h"
#include "model/data/model.h"
#include "model/data/numbers.h"
#include "model/data/tyre.h"
#include "model/write/model_json.h"

static const char *const axes[] = {"x", "y", "z"};
static const char *const forms[] = {"brush", "MF 5.2", "MF 6.1"};

static void put_road(kmp_json *json, const kempe_model *model, int k)
{
    const kmp_road *road = &model->roads[k];
    kmp_text height = {0};
    kmp_model_json_point(json, road->height ? "at" : "flat", model, road->point);
    kmp_json_put(json, "normal %s", axes[road->normal]);
    if (road->height) {
        kmp_json_put(json, "along %s", axes[road->along]);
        kmp_model_put_expr(&height, model, road->height);
        kmp_json_text(json, "height", &height);
    }
    kmp_json_number(json, "friction", road->friction.value);
}

static void put_tyre(kmp_json *json, const kempe_model *model, int number)
{
    const kmp_tyre *tyre = &model->tyres[number];
    kmp_json_string(json, "on", model->roads[tyre->road].name);
    kmp_model_json_point(json, "at", model, tyre->point);
    kmp_json_string(json, "model", forms[tyre->form]);
    if (tyre->tir) {
        kmp_json_string(json, "file", tyre->file);
        kmp_json_string(json, "slip_angle", tyre->tangent ? "tangent" : "angle");
        kmp_json_string(json, "mirrored", tyre->mirrored ? "yes" : "no");
    }
    kmp_json_number(json, "mode",
                    (tyre->combined                ? 4
                     : tyre->along && tyre->across ? 3
                     : tyre->across                ? 2
                                                   : tyre->along) +
                        (tyre->state >= 0 ? 10 : 0));
    for (int k = 0; k < KMP_TYRE_FIELDS; k++)
        if (kmp_tyre_get(tyre, k)->value != 0)
            kmp_json_number(json, kmp_tyre_fields[k].key, kmp_tyre_get(tyre, k)->value);
    if (json->layout != KMP_JSON_WORDS && tyre->tir)
        kmp_json_numbers(json, "coefficients", KMP_TIR_COUNT, tyre->tir);
}

const kmp_writer_wing kmp_tyre_writer[] = {
    {KMP_WRITTEN(roads, road), false, put_road, NULL}, {KMP_WRITTEN(tyres, tyre), true, put_tyre, NULL}, {0}};
