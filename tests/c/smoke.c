/* The walk through cutis.h in C99, with every slip a host can make: it must answer, print nothing and leak nothing. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "cutis.h"

static int failures = 0;

#define CHECK(condition)                                                      \
    do {                                                                      \
        if (!(condition)) {                                                   \
            printf("smoke.c:%d: %s\n", __LINE__, #condition);                 \
            ++failures;                                                       \
        }                                                                     \
    } while (0)

static double *values_of(const CutisSim *sim, size_t port) {
    return calloc(cutis_port_len(sim, port) + 1, sizeof(double));
}

static void describe(const CutisSim *sim) {
    size_t i, n = cutis_port_count(sim);
    double smallest, largest;
    CHECK(n > 3);
    for (i = 0; i < n; ++i) {
        char name[128], unit[32], little[4] = "???";
        size_t k, product = 1;
        CHECK(cutis_port_name(sim, i, name, sizeof name) == strlen(name) + 1);
        CHECK(cutis_port_unit(sim, i, unit, sizeof unit) == strlen(unit) + 1);
        CHECK(cutis_port_find(sim, name) == i);
        CHECK(cutis_port_name(sim, i, NULL, 0) == strlen(name) + 1);
        CHECK(cutis_port_name(sim, i, little, sizeof little) == strlen(name) + 1);
        CHECK(strlen(little) < sizeof little && strncmp(little, name, strlen(little)) == 0);
        CHECK(cutis_port_description(sim, i, NULL, 0) > 1);
        for (k = 0; k < cutis_port_rank(sim, i); ++k) product *= cutis_port_dim(sim, i, k);
        CHECK(product == cutis_port_len(sim, i));
        CHECK(cutis_port_type(sim, i) != CUTIS_NO_TYPE);
        CHECK(cutis_port_causality(sim, i) != CUTIS_NO_CAUSALITY);
        CHECK(cutis_port_range(sim, i, &smallest, &largest) == CUTIS_OK && smallest < largest);
        CHECK(cutis_port_range(sim, i, NULL, &largest) == CUTIS_NULL);
    }
    CHECK(cutis_port_range(sim, n, &smallest, &largest) == CUTIS_ARGUMENT);
    CHECK(cutis_port_find(sim, "no.such.port") == SIZE_MAX);
    CHECK(cutis_port_find(sim, NULL) == SIZE_MAX);
    CHECK(cutis_port_name(sim, n, NULL, 0) == 0);
    CHECK(cutis_port_len(sim, n) == 0);
    CHECK(cutis_port_type(sim, n) == CUTIS_NO_TYPE);
}

static void misuse(CutisSim *sim, size_t bones, size_t skin) {
    char message[512];
    double nan3[3] = {0.0, 0.0, 0.0};
    const unsigned char bytes3[3] = {1, 2, 3};
    double *d = values_of(sim, bones);
    size_t n = cutis_port_len(sim, bones);
    CHECK(cutis_sim_set_f64(NULL, bones, d, n) == CUTIS_NULL);
    CHECK(cutis_sim_set_f64(sim, bones, NULL, n) == CUTIS_NULL);
    CHECK(cutis_sim_set_f64(sim, bones, d, n + 1) == CUTIS_ARGUMENT);
    CHECK(cutis_sim_set_f64(sim, (size_t)-1, d, n) == CUTIS_ARGUMENT);
    CHECK(cutis_sim_set_f64(sim, skin, nan3, cutis_port_len(sim, skin)) == CUTIS_ARGUMENT);
    d[0] = NAN;
    CHECK(cutis_sim_set_f64(sim, bones, d, n) == CUTIS_ARGUMENT);
    CHECK(cutis_sim_message(sim, message, sizeof message) > 1 && strstr(message, "bone.translation") != NULL);
    CHECK(cutis_sim_get_i32(sim, bones, NULL, 0) == CUTIS_ARGUMENT);
    CHECK(cutis_sim_step(sim, 0.0) == CUTIS_ARGUMENT);
    CHECK(cutis_sim_step(sim, -1.0) == CUTIS_ARGUMENT);
    CHECK(cutis_sim_step(sim, NAN) == CUTIS_ARGUMENT);
    CHECK(cutis_sim_step(NULL, 1.0) == CUTIS_NULL);
    CHECK(cutis_sim_run_until(NULL, 1.0, 0.1) == CUTIS_NULL);
    CHECK(cutis_sim_run_until(sim, -1.0, 0.1) == CUTIS_ARGUMENT);
    CHECK(cutis_sim_run_until(sim, NAN, 0.1) == CUTIS_ARGUMENT);
    CHECK(cutis_sim_run_until(sim, 1.0, 0.0) == CUTIS_ARGUMENT);
    CHECK(cutis_sim_run_until(sim, 1.0, 1e-12) == CUTIS_ARGUMENT);
    CHECK(cutis_sim_run_until(sim, cutis_sim_time(sim), 0.1) == CUTIS_OK);
    CHECK(cutis_sim_new_from_baked("", bytes3, sizeof bytes3, message, sizeof message) == NULL && message[0] != 0);
    CHECK(cutis_sim_new_from_baked(NULL, NULL, 1, message, sizeof message) == NULL && strstr(message, "scene") != NULL);
    CHECK(cutis_sim_set_time(sim, INFINITY) == CUTIS_ARGUMENT);
    CHECK(isnan(cutis_sim_time(NULL)));
    CHECK(cutis_sim_restore(sim, NULL) == CUTIS_NULL);
    CHECK(cutis_sim_save(NULL) == NULL);
    CHECK(cutis_sim_directional_derivative(NULL, &skin, 1, &bones, 1, d, 0, d, 0) == CUTIS_NULL);
    CHECK(cutis_sim_adjoint_derivative(sim, NULL, 1, &bones, 1, NULL, 0, NULL, 0) == CUTIS_NULL);
    CHECK(cutis_sim_adjoint_derivative(sim, &skin, 1, &bones, 1, NULL, 0, d, cutis_port_len(sim, bones)) == CUTIS_STEP);
    CHECK(cutis_sim_message(sim, message, sizeof message) > 1 && strstr(message, "equilibrium") != NULL);
    CHECK(cutis_sim_warning(sim, message, sizeof message) >= 1 && cutis_sim_warning(NULL, message, 9) == 0);
    CHECK(cutis_sim_message(NULL, message, sizeof message) == 0);
    cutis_sim_free(NULL);
    cutis_state_free(NULL);
    free(d);
}

int main(int argc, char **argv) {
    char why[512] = "";
    double *d, *x, *y;
    unsigned char *bytes;
    size_t bones, skin, n, size, i;
    double one = 0.0, other = 0.0;
    CutisState *state, *copy = NULL;
    CutisSim *sim;

    CHECK(cutis_abi() == CUTIS_ABI);
    CHECK(strncmp(cutis_version(), "0.", 2) == 0 || cutis_version()[0] != '0');

    CHECK(cutis_sim_new_from_file("/no/such/scene.toml", why, sizeof why) == NULL);
    CHECK(strstr(why, "/no/such/scene.toml") != NULL);
    CHECK(cutis_sim_new_from_file(NULL, why, sizeof why) == NULL);
    CHECK(cutis_sim_new_from_text("this = [is no scene", NULL, why, sizeof why) == NULL && strlen(why) > 0);
    CHECK(cutis_sim_new_from_text("", NULL, NULL, 0) == NULL);

    sim = argc > 1 ? cutis_sim_new_from_file(argv[1], why, sizeof why) : cutis_sim_new_default(why, sizeof why);
    if (sim == NULL) {
        printf("smoke: %s\n", why);
        return 1;
    }
    describe(sim);
    bones = cutis_port_find(sim, "bone.translation");
    skin = cutis_port_find(sim, "skin.position");
    n = cutis_port_len(sim, skin);
    misuse(sim, bones, skin);

    d = values_of(sim, bones);
    x = values_of(sim, skin);
    y = values_of(sim, skin);
    CHECK(cutis_sim_initialise(sim) == CUTIS_OK);
    d[cutis_port_len(sim, bones) - 1] = -1e-3;
    CHECK(cutis_sim_set_f64(sim, bones, d, cutis_port_len(sim, bones)) == CUTIS_OK);
    state = cutis_sim_save(sim);
    CHECK(state != NULL);
    CHECK(cutis_sim_step(sim, 0.015625) == CUTIS_OK);
    CHECK(cutis_sim_time(sim) == 0.015625);
    CHECK(cutis_sim_get_f64(sim, skin, x, n) == CUTIS_OK);

    /* Until a time, in steps of no more than a given length: the same bits for the same steps. */
    CHECK(cutis_sim_restore(sim, state) == CUTIS_OK);
    CHECK(cutis_sim_run_until(sim, 0.015625, 1.0) == CUTIS_OK && cutis_sim_time(sim) == 0.015625);
    CHECK(cutis_sim_get_f64(sim, skin, y, n) == CUTIS_OK);
    CHECK(memcmp(x, y, n * sizeof *x) == 0);
    CHECK(cutis_sim_run_until(sim, 0.0625, 0.02) == CUTIS_OK && fabs(cutis_sim_time(sim) - 0.0625) < 1e-15);

    /* Back, and once more: the same bits. */
    CHECK(cutis_sim_restore(sim, state) == CUTIS_OK);
    CHECK(cutis_sim_time(sim) == 0.0);
    CHECK(cutis_sim_step(sim, 0.015625) == CUTIS_OK);
    CHECK(cutis_sim_get_f64(sim, skin, y, n) == CUTIS_OK);
    CHECK(memcmp(x, y, n * sizeof *x) == 0);

    /* Through bytes, and once more. */
    size = cutis_state_size(sim, state);
    bytes = malloc(size);
    CHECK(size > 0 && cutis_state_serialize(sim, state, bytes, size - 1) == CUTIS_ARGUMENT);
    CHECK(cutis_state_serialize(sim, state, bytes, size) == CUTIS_OK);
    CHECK(cutis_state_deserialize(sim, bytes, size, &copy) == CUTIS_OK);
    CHECK(cutis_sim_restore(sim, copy) == CUTIS_OK);
    CHECK(cutis_sim_step(sim, 0.015625) == CUTIS_OK);
    CHECK(cutis_sim_get_f64(sim, skin, y, n) == CUTIS_OK);
    CHECK(memcmp(x, y, n * sizeof *x) == 0);
    cutis_state_free(copy);
    copy = NULL;
    bytes[size / 2] ^= 1;
    CHECK(cutis_state_deserialize(sim, bytes, size, &copy) == CUTIS_STATE && copy == NULL);
    CHECK(cutis_state_deserialize(sim, bytes, 3, &copy) == CUTIS_STATE && copy == NULL);

    /* <J v, J v> = <J^T J v, v>, with v in d and x, y for the products. */
    CHECK(cutis_sim_directional_derivative(sim, &skin, 1, &bones, 1, d, cutis_port_len(sim, bones), x, n) == CUTIS_OK);
    CHECK(cutis_sim_adjoint_derivative(sim, &skin, 1, &bones, 1, x, n, y, cutis_port_len(sim, bones)) == CUTIS_OK);
    for (i = 0; i < n; ++i) one += x[i] * x[i];
    for (i = 0; i < cutis_port_len(sim, bones); ++i) other += y[i] * d[i];
    CHECK(one > 0.0 && fabs(one - other) < 1e-7 * one);
    CHECK(cutis_sim_directional_derivative(sim, &skin, 1, &bones, 1, d, 1, x, n) == CUTIS_ARGUMENT);
    CHECK(cutis_sim_directional_derivative(sim, &skin, 1, &n, 1, d, 1, x, n) == CUTIS_ARGUMENT);

    CHECK(cutis_sim_reset(sim) == CUTIS_OK && cutis_sim_time(sim) == 0.0);
    cutis_sim_free(sim);
    cutis_state_free(state);
    free(bytes);
    free(d);
    free(x);
    free(y);
    if (failures == 0) printf("smoke: all is well\n");
    return failures != 0;
}
