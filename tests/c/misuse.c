/* Every function of both FMI headers, called with nothing, in every order: an answer or an error, never a crash.
 * Arguments: a scene file that is alone in its folder, and the list of functions. */
#include <dlfcn.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "cutis.h"

static int failures = 0;
static int logged = 0;

#define CHECK(condition)                                                      \
    do {                                                                      \
        if (!(condition)) {                                                   \
            printf("misuse.c:%d: %s\n", __LINE__, #condition);                \
            ++failures;                                                       \
        }                                                                     \
    } while (0)

enum { OK, WARNING, DISCARD, ERROR, FATAL };
enum { ORDERS = 400 };

/* Enough zero words for the longest signature of both headers. */
typedef int (*AnyCall)(void *, uintptr_t, uintptr_t, uintptr_t, uintptr_t, uintptr_t, uintptr_t, uintptr_t, uintptr_t);

extern void *fmi3InstantiateCoSimulation(const char *, const char *, const char *, uint8_t, uint8_t, uint8_t, uint8_t,
                                         const uint32_t *, size_t, void *,
                                         void (*)(void *, int, const char *, const char *),
                                         void (*)(void *, double, uint8_t, uint8_t, uint8_t, uint8_t, uint8_t *, double *));
extern void *fmi3InstantiateModelExchange(const char *, const char *, const char *, uint8_t, uint8_t, void *,
                                          void (*)(void *, int, const char *, const char *));
extern void fmi3FreeInstance(void *);
extern int fmi3Reset(void *);
extern int fmi3EnterInitializationMode(void *, uint8_t, double, double, uint8_t, double);
extern int fmi3ExitInitializationMode(void *);
extern int fmi3GetFloat64(void *, const uint32_t *, size_t, double *, size_t);
extern int fmi3SetFloat64(void *, const uint32_t *, size_t, const double *, size_t);
extern int fmi3DoStep(void *, double, double, uint8_t, uint8_t *, uint8_t *, uint8_t *, double *);
extern int fmi3GetFMUState(void *, void **);
extern int fmi3SetFMUState(void *, void *);
extern int fmi3FreeFMUState(void *, void **);
extern int fmi3SetDebugLogging(void *, uint8_t, size_t, const char *const *);
extern int fmi3Terminate(void *);

struct Functions2 {
    void (*logger)(void *, const char *, int, const char *, const char *, ...);
    void *allocate, *release, *finished, *environment;
};
extern void *fmi2Instantiate(const char *, int, const char *, const char *, const struct Functions2 *, int, int);
extern void fmi2FreeInstance(void *);
extern int fmi2Reset(void *);
extern int fmi2SetupExperiment(void *, int, double, double, int, double);
extern int fmi2EnterInitializationMode(void *);
extern int fmi2ExitInitializationMode(void *);
extern int fmi2DoStep(void *, double, double, int);
extern int fmi2GetReal(void *, const unsigned *, size_t, double *);
extern int fmi2GetRealStatus(void *, int, double *);

static void tell3(void *environment, int status, const char *category, const char *message) {
    CHECK(environment == &logged && status >= OK && status <= FATAL && strncmp(category, "log", 3) == 0);
    CHECK(strlen(message) > 0 && message[strlen(message) - 1] != '\n');
    ++logged;
}

static void tell2(void *environment, const char *name, int status, const char *category, const char *message, ...) {
    CHECK(environment == &logged && strcmp(name, "two") == 0 && status >= OK && strncmp(category, "log", 3) == 0);
    CHECK(strcmp(message, "%s") == 0);
    ++logged;
}

static char folder[1024], uri[1100];
static char names[256][64];
static AnyCall calls[256];
static int n_calls = 0;

static void read_names(const char *path) {
    void *self = dlopen(NULL, RTLD_NOW);
    FILE *file = fopen(path, "r");
    if (file == NULL) {
        printf("%s is missing\n", path);
        exit(2);
    }
    while (n_calls < 256 && fscanf(file, "%63s", names[n_calls]) == 1) {
        const char *name = names[n_calls];
        void *symbol = dlsym(self, name);
        CHECK(symbol != NULL);
        if (strstr(name, "Instantiate") || strstr(name, "GetVersion") || strstr(name, "GetTypesPlatform") || strstr(name, "FreeInstance")) continue;
        memcpy(&calls[n_calls], &symbol, sizeof symbol);
        ++n_calls;
    }
    fclose(file);
    CHECK(n_calls > 100);
}

static void *three(const char *token, int on) {
    return fmi3InstantiateCoSimulation("three", token, folder, 0, (uint8_t)on, 0, 0, NULL, 0, &logged, tell3, NULL);
}

static void instantiation(const char *token) {
    struct Functions2 functions = {tell2, NULL, NULL, NULL, NULL};
    functions.environment = &logged;
    logged = 0;
    CHECK(three("{wrong}", 1) == NULL && logged == 1);
    CHECK(three("{wrong}", 0) == NULL && logged == 1);
    CHECK(three(NULL, 1) == NULL);
    CHECK(fmi3InstantiateCoSimulation("", token, folder, 0, 1, 0, 0, NULL, 0, &logged, tell3, NULL) == NULL);
    CHECK(fmi3InstantiateCoSimulation(NULL, token, folder, 0, 1, 0, 0, NULL, 0, &logged, tell3, NULL) == NULL);
    CHECK(fmi3InstantiateCoSimulation("a", token, folder, 0, 1, 1, 0, NULL, 0, &logged, tell3, NULL) == NULL);
    CHECK(fmi3InstantiateCoSimulation("a", "{wrong}", folder, 0, 1, 0, 0, NULL, 0, NULL, NULL, NULL) == NULL);
    CHECK(fmi3InstantiateModelExchange("a", token, NULL, 0, 1, &logged, tell3) == NULL);
    CHECK(logged == 6);
    CHECK(fmi2Instantiate("two", 1, token, uri, NULL, 0, 1) == NULL);
    CHECK(fmi2Instantiate("two", 0, token, NULL, &functions, 0, 1) == NULL);
    CHECK(fmi2Instantiate("two", 1, "{wrong}", uri, &functions, 0, 1) == NULL);
    CHECK(fmi2Instantiate("two", 1, token, "http://example.org/x", &functions, 0, 1) == NULL);
    CHECK(logged == 9);
    fmi3FreeInstance(NULL);
    fmi2FreeInstance(NULL);
}

/* What the intermediate update does, and what it saw. */
static struct {
    void *instance;
    int calls;
    double time;
} inside;

static void update(void *environment, double time, uint8_t set, uint8_t get, uint8_t finished, uint8_t early,
                   uint8_t *requested, double *early_time) {
    const uint32_t clock = 0, unknown = 999;
    double t = -1.0, one = 0.0;
    uint8_t e, s, r;
    CHECK(environment == &logged && !set && get && finished && !early && requested != NULL && early_time != NULL);
    CHECK(fmi3GetFloat64(inside.instance, &clock, 1, &t, 1) == OK && t == time);
    CHECK(fmi3GetFloat64(inside.instance, &unknown, 1, &one, 1) == ERROR);
    CHECK(fmi3GetFloat64(inside.instance, &clock, 1, &one, 2) == ERROR);
    /* Nothing else may be done inside a step. */
    CHECK(fmi3SetFloat64(inside.instance, &clock, 1, &one, 1) == ERROR);
    CHECK(fmi3DoStep(inside.instance, time, 0.1, 0, &e, &s, &r, &one) == ERROR);
    CHECK(fmi3Terminate(inside.instance) == ERROR);
    *requested = 1; /* is not asked for, and must not matter */
    *early_time = time;
    inside.time = time;
    ++inside.calls;
}

static void intermediate_update(const char *token) {
    const uint32_t translation = 10, clock = 0;
    double d[6] = {0, 0, 0, 0.001, 0, 0}, reached = 0, t = 0;
    uint8_t e, s, r = 9;
    void *a = fmi3InstantiateCoSimulation("three", token, folder, 0, 1, 0, 1, NULL, 0, &logged, tell3, update);
    CHECK(a != NULL);
    inside.instance = a;
    CHECK(fmi3EnterInitializationMode(a, 0, 0.0, 0.0, 0, 0.0) == OK && fmi3ExitInitializationMode(a) == OK);
    CHECK(inside.calls == 0);
    CHECK(fmi3SetFloat64(a, &translation, 1, d, 6) == OK);
    CHECK(fmi3DoStep(a, 0.0, 0.25, 0, &e, &s, &r, &reached) == OK && reached == 0.25 && r == 0);
    CHECK(inside.calls >= 1 && inside.time == 0.25);
    CHECK(fmi3GetFloat64(a, &clock, 1, &t, 1) == OK && t == 0.25);
    CHECK(fmi3DoStep(a, 0.25, 0.25, 0, &e, &s, &r, &reached) == OK && inside.time == 0.5);
    fmi3FreeInstance(a);
}

static void states(const char *token) {
    void *a = three(token, 1), *state = NULL, *wild = &logged;
    uint8_t e, t, r;
    double reached, time = -1.0;
    const uint32_t time_reference = 0;
    const char *const category = "no such category";
    CHECK(a != NULL);
    CHECK(fmi3EnterInitializationMode(a, 0, 0.0, 3.0, 1, 3.05) == OK);
    CHECK(fmi3ExitInitializationMode(a) == OK);
    CHECK(fmi3GetFMUState(a, &state) == OK && state != NULL);
    CHECK(fmi3DoStep(a, 3.0, 0.02, 0, &e, &t, &r, &reached) == OK && reached == 3.02 && !e && !t && !r);
    CHECK(fmi3DoStep(a, 3.0, 0.02, 0, &e, &t, &r, &reached) == ERROR);
    CHECK(fmi3DoStep(a, 3.02, 0.02, 0, &e, &t, &r, &reached) == ERROR);
    CHECK(fmi3GetFloat64(a, &time_reference, 1, &time, 1) == OK && time == 3.02);
    CHECK(fmi3SetFMUState(a, state) == OK);
    CHECK(fmi3GetFloat64(a, &time_reference, 1, &time, 1) == OK && time == 3.0);
    CHECK(fmi3DoStep(a, 3.0, 0.1, 0, &e, &t, &r, &reached) == ERROR); /* passes the stop time */
    CHECK(fmi3SetFMUState(a, state) == OK);
    CHECK(fmi3DoStep(a, 3.0, 0.05, 0, &e, &t, &r, NULL) == ERROR);
    CHECK(fmi3SetFMUState(a, state) == OK);
    CHECK(fmi3SetFloat64(a, &time_reference, 1, &time, 1) == ERROR);
    CHECK(fmi3SetFMUState(a, state) == OK);
    CHECK(fmi3GetFMUState(a, &state) == OK);
    CHECK(fmi3SetFMUState(a, wild) == ERROR);
    CHECK(fmi3SetFMUState(a, state) == OK);
    CHECK(fmi3FreeFMUState(a, &wild) == ERROR);
    CHECK(fmi3FreeFMUState(a, &state) == OK && state == NULL);
    CHECK(fmi3FreeFMUState(a, &state) == OK);
    CHECK(fmi3FreeFMUState(a, NULL) == OK);
    CHECK(fmi3SetDebugLogging(a, 1, 1, &category) == ERROR);
    CHECK(fmi3GetFloat64(a, NULL, 0, NULL, 0) == OK);
    CHECK(fmi3Reset(a) == OK);
    CHECK(fmi3Terminate(a) == ERROR);
    CHECK(fmi2Reset(a) == ERROR); /* not its kind */
    logged = 0;
    CHECK(fmi3SetDebugLogging(a, 0, 0, NULL) == OK);
    CHECK(fmi3ExitInitializationMode(a) == ERROR && logged == 0);
    fmi3FreeInstance(a);
}

static void anything(const char *token) {
    struct Functions2 functions = {tell2, NULL, NULL, NULL, NULL};
    void *instance[2];
    unsigned seed = 7;
    int i, k;
    functions.environment = &logged;
    for (i = 0; i < n_calls; ++i) CHECK(calls[i](NULL, 0, 0, 0, 0, 0, 0, 0, 0) == ERROR);
    instance[0] = fmi2Instantiate("two", 1, token, uri, &functions, 0, 0);
    instance[1] = three(token, 1);
    CHECK(instance[0] != NULL && instance[1] != NULL);
    for (k = 0; k < ORDERS; ++k) {
        int version, status;
        seed = seed * 1103515245u + 12345u;
        i = (int)((seed >> 16) % (unsigned)n_calls);
        version = names[i][3] == '3';
        status = calls[i](instance[version], 0, 0, 0, 0, 0, 0, 0, 0);
        if (status < OK || status >= FATAL) {
            printf("%s: %d\n", names[i], status);
            ++failures;
        }
        if (calls[i](instance[!version], 0, 0, 0, 0, 0, 0, 0, 0) != ERROR) {
            printf("%s took an instance of the other version\n", names[i]);
            ++failures;
        }
    }
    CHECK(fmi2Reset(instance[0]) == OK && fmi3Reset(instance[1]) == OK);
    {
        const unsigned time = 0;
        double t = -1.0;
        CHECK(fmi2GetReal(instance[0], &time, 1, &t) == ERROR);
        CHECK(fmi2Reset(instance[0]) == OK);
        CHECK(fmi2EnterInitializationMode(instance[0]) == ERROR);
        CHECK(fmi2Reset(instance[0]) == OK);
        CHECK(fmi2SetupExperiment(instance[0], 0, 0.0, 1.0, 0, 0.0) == OK);
        CHECK(fmi2EnterInitializationMode(instance[0]) == OK && fmi2ExitInitializationMode(instance[0]) == OK);
        CHECK(fmi2DoStep(instance[0], 1.0, 0.5, 1) == OK);
        CHECK(fmi2GetReal(instance[0], &time, 1, &t) == OK && t == 1.5);
        CHECK(fmi2GetRealStatus(instance[0], 2, &t) == OK && t == 1.5);
        CHECK(fmi2GetRealStatus(instance[0], 0, &t) == DISCARD);
    }
    fmi2FreeInstance(instance[0]);
    fmi3FreeInstance(instance[1]);
}

int main(int argc, char **argv) {
    char token[256] = "", why[512] = "";
    const char *slash;
    CutisSim *sim;
    if (argc < 3 || strlen(argv[1]) > 1000 || (slash = strrchr(argv[1], '/')) == NULL) return 2;
    sim = cutis_sim_new_from_file(argv[1], why, sizeof why);
    if (sim == NULL) {
        printf("misuse: %s\n", why);
        return 2;
    }
    CHECK(cutis_sim_token(sim, token, sizeof token) > 1);
    cutis_sim_free(sim);
    sprintf(folder, "%.*s/", (int)(slash - argv[1]), argv[1]);
    sprintf(uri, "file://%s", folder);
    read_names(argv[2]);
    instantiation(token);
    states(token);
    intermediate_update(token);
    anything(token);
    if (failures == 0) printf("misuse: all is well\n");
    return failures != 0;
}
