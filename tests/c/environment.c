/* Hosts that trap floating-point exceptions, round otherwise or flush small numbers to zero: the same bits as in the default
 * environment, and theirs is given back, in callbacks, too. Argument: a scene file that is alone in its folder. */
#define _GNU_SOURCE
#include <fenv.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#ifdef __SSE2__
#include <xmmintrin.h>
#endif

#include "cutis.h"

static int failures = 0;

#define CHECK(condition)                                                      \
    do {                                                                      \
        if (!(condition)) {                                                   \
            printf("environment.c:%d: %s\n", __LINE__, #condition);           \
            ++failures;                                                       \
        }                                                                     \
    } while (0)

extern void *fmi3InstantiateCoSimulation(const char *, const char *, const char *, uint8_t, uint8_t, uint8_t, uint8_t,
                                         const uint32_t *, size_t, void *,
                                         void (*)(void *, int, const char *, const char *),
                                         void (*)(void *, double, uint8_t, uint8_t, uint8_t, uint8_t, uint8_t *, double *));
extern void fmi3FreeInstance(void *);
extern int fmi3EnterInitializationMode(void *, uint8_t, double, double, uint8_t, double);
extern int fmi3ExitInitializationMode(void *);
extern int fmi3GetFloat64(void *, const uint32_t *, size_t, double *, size_t);
extern int fmi3SetFloat64(void *, const uint32_t *, size_t, const double *, size_t);
extern int fmi3DoStep(void *, double, double, uint8_t, uint8_t *, uint8_t *, uint8_t *, double *);

enum { MOST = 3000 };

/* What a host does with its environment, and what it must find again. */
struct Setting {
    const char *name;
    int traps, rounding, flush;
};

static struct Setting now;
static int looked = 0;

static void apply(const struct Setting *s) {
    fesetenv(FE_DFL_ENV);
    now = *s;
    fesetround(s->rounding);
#ifdef __SSE2__
    if (s->flush) _mm_setcsr(_mm_getcsr() | 0x8040);
#endif
    feenableexcept(s->traps);
}

static int is_there(void) {
    int there = fegetround() == now.rounding && fegetexcept() == now.traps;
#ifdef __SSE2__
    there = there && ((_mm_getcsr() & 0x8040) != 0) == now.flush;
#endif
    return there;
}

static void tell(void *environment, int status, const char *category, const char *message) {
    (void)environment, (void)status, (void)category, (void)message;
    CHECK(is_there());
    ++looked;
}

static void update(void *environment, double time, uint8_t set, uint8_t get, uint8_t finished, uint8_t early,
                   uint8_t *returns, double *at) {
    (void)environment, (void)time, (void)set, (void)get, (void)finished, (void)early, (void)returns, (void)at;
    CHECK(is_there());
    ++looked;
}

static size_t through_c(const char *path, double *out) {
    char why[300] = "";
    CutisSim *sim = cutis_sim_new_from_file(path, why, sizeof why);
    if (sim == NULL) {
        printf("%s\n", why);
        return 0;
    }
    CHECK(is_there());
    size_t skin = cutis_port_find(sim, "skin.position"), bones = cutis_port_find(sim, "bone.translation");
    size_t n = cutis_port_len(sim, skin), m = cutis_port_len(sim, bones);
    double d[30] = {0.0};
    CHECK(n < MOST && m <= 30 && cutis_sim_initialise(sim) == CUTIS_OK && is_there());
    for (int k = 1; k <= 3; ++k) {
        d[m - 3] = 0.002 * k, d[m - 1] = -0.001 * k;
        CHECK(cutis_sim_set_f64(sim, bones, d, m) == CUTIS_OK && cutis_sim_step(sim, 0.1) == CUTIS_OK && is_there());
    }
    CHECK(cutis_sim_get_f64(sim, skin, out, n) == CUTIS_OK && is_there());
    double v[30] = {0.0};
    v[m - 2] = 1.0;
    CHECK(cutis_sim_directional_derivative(sim, &skin, 1, &bones, 1, v, m, out + n, n) == CUTIS_OK && is_there());
    d[m - 3] = 900.0;
    CHECK(cutis_sim_set_f64(sim, bones, d, m) == CUTIS_OK);
    CHECK(cutis_sim_step(sim, 0.1) == CUTIS_STEP && is_there());
    cutis_sim_free(sim);
    CHECK(is_there());
    return 2 * n;
}

static size_t through_fmi(const char *folder, const char *token, size_t n, size_t m, double *out) {
    uint32_t bones = 10, skin = 100;
    double d[30] = {0.0}, t = 0.0;
    uint8_t a, b, c;
    looked = 0;
    void *i = fmi3InstantiateCoSimulation("x", token, folder, 0, 1, 0, 0, NULL, 0, NULL, tell, update);
    CHECK(i != NULL && is_there());
    CHECK(fmi3EnterInitializationMode(i, 0, 0.0, 0.0, 0, 0.0) == 0 && fmi3ExitInitializationMode(i) == 0 && is_there());
    for (int k = 1; k <= 3; ++k) {
        d[m - 3] = 0.002 * k, d[m - 1] = -0.001 * k;
        CHECK(fmi3SetFloat64(i, &bones, 1, d, m) == 0);
        CHECK(fmi3DoStep(i, t, 0.1, 0, &a, &b, &c, &t) == 0 && is_there());
    }
    CHECK(fmi3GetFloat64(i, &skin, 1, out, n) == 0 && is_there());
    fmi3FreeInstance(i);
    CHECK(looked >= 6 && is_there());
    return n;
}

int main(int argc, char **argv) {
    (void)argc;
    const int all = FE_DIVBYZERO | FE_INVALID | FE_OVERFLOW | FE_UNDERFLOW | FE_INEXACT;
    const struct Setting settings[] = {
        {"default", 0, FE_TONEAREST, 0},
        {"traps", FE_DIVBYZERO | FE_INVALID | FE_OVERFLOW, FE_TONEAREST, 0},
        {"traps of every kind", all, FE_TONEAREST, 0},
        {"upward", 0, FE_UPWARD, 0},
        {"downward", 0, FE_DOWNWARD, 0},
        {"toward zero", 0, FE_TOWARDZERO, 0},
#ifdef __SSE2__
        {"flushed", 0, FE_TONEAREST, 1},
        {"all at once", all, FE_UPWARD, 1},
#endif
    };
    static double first[2 * MOST], second[2 * MOST], fmi[2 * MOST];
    char folder[1000] = "", token[64] = "";
    snprintf(folder, sizeof folder, "%.*s", (int)(strrchr(argv[1], '/') - argv[1] + 1), argv[1]);
    CutisSim *sim = cutis_sim_new_from_file(argv[1], NULL, 0);
    cutis_sim_token(sim, token, sizeof token);
    size_t n = cutis_port_len(sim, cutis_port_find(sim, "skin.position"));
    size_t m = cutis_port_len(sim, cutis_port_find(sim, "bone.translation"));
    cutis_sim_free(sim);
    size_t wanted = 0;
    for (size_t k = 0; k < sizeof settings / sizeof settings[0]; ++k) {
        apply(&settings[k]);
        size_t found = through_c(argv[1], k == 0 ? first : second);
        through_fmi(folder, token, n, m, fmi);
        fesetenv(FE_DFL_ENV);
        if (k == 0) wanted = found;
        if (found != wanted || wanted == 0 || (k > 0 && memcmp(first, second, wanted * sizeof(double)) != 0)
            || memcmp(first, fmi, n * sizeof(double)) != 0) {
            printf("other numbers: %s\n", settings[k].name);
            ++failures;
        }
    }
    puts(failures == 0 ? "environment: all is well" : "environment: failed");
    return failures != 0;
}
