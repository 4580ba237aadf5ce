/* cutis: soft tissue of the human face. C99 and C++11.
 *
 *   char why[256];
 *   CutisSim *sim = cutis_sim_new_default(why, sizeof why);
 *   size_t bones = cutis_port_find(sim, "bone.translation"), skin = cutis_port_find(sim, "skin.position");
 *   cutis_sim_initialise(sim);
 *   cutis_sim_set_f64(sim, bones, d, cutis_port_len(sim, bones));
 *   cutis_sim_step(sim, 0.01);
 *   cutis_sim_get_f64(sim, skin, x, cutis_port_len(sim, skin));
 *   cutis_sim_free(sim);
 *
 * All values are in SI units. Every call returns; none prints, exits or throws. A call that fails changes
 * nothing, and cutis_sim_message tells why. Generated from src/ffi/capi.rs; do not edit.
 */
#ifndef CUTIS_H
#define CUTIS_H

#include <stddef.h>
#include <stdint.h>

#define CUTIS_VERSION_MAJOR 0
#define CUTIS_VERSION_MINOR 1
#define CUTIS_VERSION_PATCH 0
#define CUTIS_ABI 1

// Number type of a port. Numbers are fixed for ever.
typedef enum CutisType {
  // double
  CUTIS_FLOAT64 = 0,
  // int32_t
  CUTIS_INT32 = 1,
  // uint8_t, 0 or 1
  CUTIS_BOOLEAN = 2,
  // There is no such port.
  CUTIS_NO_TYPE = -1,
} CutisType;

// Who writes a port. Numbers are fixed for ever.
typedef enum CutisCausality {
  // Simulation time, s.
  CUTIS_INDEPENDENT = 0,
  // Set by the host before any step.
  CUTIS_INPUT = 1,
  // Computed by each step.
  CUTIS_OUTPUT = 2,
  // Set by the host before cutis_sim_initialise.
  CUTIS_PARAMETER = 3,
  // Computed once from the scene.
  CUTIS_CALCULATED_PARAMETER = 4,
  // A parameter that the host may set before any step, too.
  CUTIS_TUNABLE_PARAMETER = 5,
  // There is no such port.
  CUTIS_NO_CAUSALITY = -1,
} CutisCausality;

// What a call came to. Numbers are fixed for ever.
typedef enum CutisStatus {
  // Done.
  CUTIS_OK = 0,
  // A handle or a required pointer is NULL, or the pointer is no handle of this kind.
  CUTIS_NULL = 1,
  // A port index, length, type or value is not legal; nothing was changed.
  CUTIS_ARGUMENT = 2,
  // The step or the equilibrium failed; the simulation stands where it stood before the call.
  CUTIS_STEP = 3,
  // A saved state is damaged, or belongs to another scene or version; nothing was changed.
  CUTIS_STATE = 4,
  // Another thread, or a callback, is inside this handle.
  CUTIS_BUSY = 5,
  // A defect of the library was caught; only cutis_sim_message and cutis_sim_free still answer.
  CUTIS_PANIC = 6,
  // cutis_sim_cancel ended the call; the simulation stands at its last accepted step.
  CUTIS_CANCELLED = 7,
} CutisStatus;

// A face that moves: the scene, where it stands, and the solver's memory.
//
// Every call computes in the default floating-point environment and gives the caller's back: traps and rounding modes of the
// caller change no bit. What would not fit into memory at all is refused where the simulation is made; where the system runs out
// of memory within a call, the process is aborted (allocation failure), as in most C++ libraries: make sure that
// cutis_sim_memory bytes are there for each simulation.
//
// Every function may be called from any thread, on one handle by one thread at a time; handles are independent. A handle
// starts a thread only where its scene asks for one (`[solver] threads`, `background`), and ends it when it is freed.
typedef struct CutisSim CutisSim;

// A saved state of a simulation; it is never changed, so any number of threads may restore from it.
typedef struct CutisState CutisState;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// Version of the library, for example "0.1.0"; the string lives as long as the library.
const char *cutis_version(void);

// Number of the binary interface; equal to CUTIS_ABI of the header a program was compiled with, or it must not go on.
uint32_t cutis_abi(void);

// A simulation of the scene file at `path` (UTF-8), at rest at t = 0 s; the mesh it names lies relative to it.
//
// Returns NULL on failure; the reason is then in `why`, cut to `why_len` bytes with its closing zero. `why` may be NULL.
// A factor or a volume that the machine has no memory for is such a failure, with the bytes wanted; what else runs out of memory
// aborts the process (see CutisSim). Free with cutis_sim_free.
//
// # Safety
// `path` is NULL or a zero-terminated string; `why` is NULL or holds `why_len` bytes.
struct CutisSim *cutis_sim_new_from_file(const char *path,
                                         char *why,
                                         size_t why_len);

// A simulation of a scene given as text (UTF-8 TOML), at rest at t = 0 s. A mesh file it names lies relative to
// `folder`, or to the working folder where `folder` is NULL.
//
// Returns NULL on failure; the reason is then in `why`, cut to `why_len` bytes with its closing zero. `why` may be NULL.
// A factor or a volume that the machine has no memory for is such a failure, with the bytes wanted; what else runs out of memory
// aborts the process (see CutisSim). Free with cutis_sim_free.
//
// # Safety
// `scene` and `folder` are NULL or zero-terminated strings; `why` is NULL or holds `why_len` bytes.
struct CutisSim *cutis_sim_new_from_text(const char *scene,
                                         const char *folder,
                                         char *why,
                                         size_t why_len);

// A simulation of a baked scene, at rest at t = 0 s: `scene` is the text (UTF-8 TOML) whose `[mesh] file` is
// "model.cutis", and the `len` bytes at `mesh` are what that file would hold. `cutis fmu` packs both under resources/. No
// file is read.
//
// Returns NULL on failure; the reason is then in `why`, cut to `why_len` bytes with its closing zero. `why` may be NULL.
// A factor or a volume that the machine has no memory for is such a failure, with the bytes wanted; what else runs out of memory
// aborts the process (see CutisSim). Free with cutis_sim_free.
//
// # Safety
// `scene` is NULL or a zero-terminated string; `mesh` is NULL or holds `len` bytes; `why` is NULL or holds `why_len` bytes.
struct CutisSim *cutis_sim_new_from_baked(const char *scene,
                                          const uint8_t *mesh,
                                          size_t len,
                                          char *why,
                                          size_t why_len);

// A simulation of the scene inside the library, a synthetic head, at rest at t = 0 s. No file is read.
//
// Returns NULL on failure; the reason is then in `why`, cut to `why_len` bytes with its closing zero. `why` may be NULL.
// A factor or a volume that the machine has no memory for is such a failure, with the bytes wanted; what else runs out of memory
// aborts the process (see CutisSim). Free with cutis_sim_free.
//
// # Safety
// `why` is NULL or holds `why_len` bytes.
struct CutisSim *cutis_sim_new_default(char *why,
                                       size_t why_len);

// Ends a simulation. NULL is no error. Saved states live on until cutis_state_free.
//
// # Safety
// `sim` is NULL or came from a cutis_sim_new function, was not freed, and no other thread uses it.
void cutis_sim_free(struct CutisSim *sim);

// Why the last call on `sim` that failed did so, in words.
//
// Copies into `buffer` as far as `len` bytes hold it, always with a closing zero, and returns the bytes the whole
// needs, closing zero included; 0 for NULL or busy handles. Ask with `len` 0 first.
//
// # Safety
// `sim` is NULL or a live handle; `buffer` is NULL or holds `len` bytes.
size_t cutis_sim_message(const struct CutisSim *sim,
                         char *buffer,
                         size_t len);

// What to know about the last cutis_sim_step, cutis_sim_run_until or cutis_sim_initialise that was done, or about the scene before the
// first: one line each, empty as a rule. Inverted elements and jumps between bones are told here.
//
// Copies as cutis_sim_message does.
//
// # Safety
// `sim` is NULL or a live handle; `buffer` is NULL or holds `len` bytes.
size_t cutis_sim_warning(const struct CutisSim *sim,
                         char *buffer,
                         size_t len);

// Number of ports: everything a host can set or get. They keep their order for the life of the handle.
//
// # Safety
// `sim` is NULL or a live handle.
size_t cutis_port_count(const struct CutisSim *sim);

// Index of the port of this name, for example "bone.translation"; SIZE_MAX where there is none.
//
// # Safety
// `sim` is NULL or a live handle; `name` is NULL or a zero-terminated string.
size_t cutis_port_find(const struct CutisSim *sim, const char *name);

// Name of a port. Copies as cutis_sim_message does; 0 where there is no such port.
//
// # Safety
// `sim` is NULL or a live handle; `buffer` is NULL or holds `len` bytes.
size_t cutis_port_name(const struct CutisSim *sim, size_t port, char *buffer, size_t len);

// SI unit of a port, "1" for none. Copies as cutis_sim_message does; 0 where there is no such port.
//
// # Safety
// `sim` is NULL or a live handle; `buffer` is NULL or holds `len` bytes.
size_t cutis_port_unit(const struct CutisSim *sim, size_t port, char *buffer, size_t len);

// One sentence about a port. Copies as cutis_sim_message does; 0 where there is no such port.
//
// # Safety
// `sim` is NULL or a live handle; `buffer` is NULL or holds `len` bytes.
size_t cutis_port_description(const struct CutisSim *sim, size_t port, char *buffer, size_t len);

// Name of a row of a port: of the bone, load or marker that row `row` of its first dimension belongs to. Copies as
// cutis_sim_message does; 0 where there is no such port or its rows have no names.
//
// # Safety
// `sim` is NULL or a live handle; `buffer` is NULL or holds `len` bytes.
size_t cutis_port_row(const struct CutisSim *sim,
                      size_t port,
                      size_t row,
                      char *buffer,
                      size_t len);

// Number of dimensions of a port, 0 for a scalar; also 0 where there is no such port.
//
// # Safety
// `sim` is NULL or a live handle.
size_t cutis_port_rank(const struct CutisSim *sim, size_t port);

// Extent of one dimension of a port, counted from 0, slowest first; 0 where there is none.
//
// # Safety
// `sim` is NULL or a live handle.
size_t cutis_port_dim(const struct CutisSim *sim, size_t port, size_t dimension);

// Number of values of a port: the product of its dimensions, 1 for a scalar; 0 where there is no such port.
//
// # Safety
// `sim` is NULL or a live handle.
size_t cutis_port_len(const struct CutisSim *sim, size_t port);

// Number type of a port; CUTIS_NO_TYPE where there is no such port.
//
// # Safety
// `sim` is NULL or a live handle.
enum CutisType cutis_port_type(const struct CutisSim *sim, size_t port);

// Who writes a port; CUTIS_NO_CAUSALITY where there is no such port.
//
// # Safety
// `sim` is NULL or a live handle.
enum CutisCausality cutis_port_causality(const struct CutisSim *sim, size_t port);

// Smallest and largest legal value of each element of a port, in its SI unit; minus and plus infinity where there is no
// such bound.
//
// CUTIS_ARGUMENT: no such port; nothing is written then.
//
// # Safety
// `sim` is NULL or a live handle; `smallest` and `largest` are NULL or the place of a number.
enum CutisStatus cutis_port_range(const struct CutisSim *sim,
                                  size_t port,
                                  double *smallest,
                                  double *largest);

// Sets all values of an input or parameter, row-major, in the port's SI unit. Nothing is computed or allocated.
//
// CUTIS_ARGUMENT: no such port, it cannot be set (a CUTIS_PARAMETER after cutis_sim_initialise), `len` is not its length, a
// value is not finite or out of the range that cutis_port_range tells, or it moves or pushes a bone that is not driven that way;
// nothing was set then.
//
// # Safety
// `sim` is NULL or a live handle; `values` is NULL or holds `len` numbers.
enum CutisStatus cutis_sim_set_f64(struct CutisSim *sim,
                                   size_t port,
                                   const double *values,
                                   size_t len);

// Copies all values of a Float64 port, row-major, in its SI unit. Nothing is computed or allocated.
//
// CUTIS_ARGUMENT: no such port, another type, or `len` is not its length; `values` is untouched then.
//
// # Safety
// `sim` is NULL or a live handle; `values` is NULL or holds `len` numbers.
enum CutisStatus cutis_sim_get_f64(const struct CutisSim *sim, size_t port, double *values, size_t len);

// Sets all values of an Int32 parameter: of "solver.mostSolves", the linear solves that a step may take at most. Nothing is
// computed or allocated.
//
// CUTIS_ARGUMENT: no such port, it cannot be set, `len` is not its length, or a value is out of range; nothing was set then.
//
// # Safety
// `sim` is NULL or a live handle; `values` is NULL or holds `len` numbers.
enum CutisStatus cutis_sim_set_i32(struct CutisSim *sim,
                                   size_t port,
                                   const int32_t *values,
                                   size_t len);

// Copies all values of an Int32 port, row-major. Nothing is computed or allocated.
//
// CUTIS_ARGUMENT: no such port, another type, or `len` is not its length; `values` is untouched then.
//
// # Safety
// `sim` is NULL or a live handle; `values` is NULL or holds `len` numbers.
enum CutisStatus cutis_sim_get_i32(const struct CutisSim *sim, size_t port, int32_t *values, size_t len);

// Copies all values of a Boolean port, row-major, as 0 and 1. Nothing is computed or allocated.
//
// CUTIS_ARGUMENT: no such port, another type, or `len` is not its length; `values` is untouched then.
//
// # Safety
// `sim` is NULL or a live handle; `values` is NULL or holds `len` bytes.
enum CutisStatus cutis_sim_get_bool(const struct CutisSim *sim, size_t port, uint8_t *values, size_t len);

// Sets the start time, s; before cutis_sim_initialise.
//
// CUTIS_ARGUMENT: `time` is not finite, or the simulation was initialised, stepped or restored and not reset since.
//
// # Safety
// `sim` is NULL or a live handle.
enum CutisStatus cutis_sim_set_time(struct CutisSim *sim,
                                    double time);

// Finds the equilibrium at the start values of inputs and parameters, from rest; no time passes. Call it once, before stepping.
//
// CUTIS_STEP: there is none within the solver's means; nothing has changed. CUTIS_ARGUMENT: a state was restored or positions
// were set and no step made since, which would be dropped: step on, or call cutis_sim_reset first.
//
// # Safety
// `sim` is NULL or a live handle.
enum CutisStatus cutis_sim_initialise(struct CutisSim *sim);

// Advances by `dt` seconds with the inputs as they stand now.
//
// CUTIS_ARGUMENT: `dt` is not positive and finite. CUTIS_STEP: the step failed, or would have taken more linear solves than
// solver.mostSolves. CUTIS_CANCELLED: cutis_sim_cancel was called meanwhile. In all cases the simulation stands at its last
// accepted step.
//
// # Safety
// `sim` is NULL or a live handle.
enum CutisStatus cutis_sim_step(struct CutisSim *sim,
                                double dt);

// Advances to time `t` (s) in equal steps of at most `dt` seconds, with the inputs as they stand now; nothing is done where
// `t` is the time already.
//
// CUTIS_ARGUMENT: `t` lies before the time or is not finite, `dt` is not positive and finite, or it would take more than a
// million steps. CUTIS_STEP, CUTIS_CANCELLED: as for cutis_sim_step; the simulation then stands at its last accepted step, and cutis_sim_time tells
// how far it came.
//
// # Safety
// `sim` is NULL or a live handle.
enum CutisStatus cutis_sim_run_until(struct CutisSim *sim,
                                     double t,
                                     double dt);

// Ends the cutis_sim_initialise, cutis_sim_step or cutis_sim_run_until that is under way on another thread before its next linear
// solve: that call then answers CUTIS_CANCELLED, and the simulation stands at its last accepted step. Nothing where no call is
// under way. The one function that may be called while another thread is inside the handle.
//
// # Safety
// `sim` is NULL or a live handle that is not freed meanwhile.
enum CutisStatus cutis_sim_cancel(struct CutisSim *sim);

// Number of nodes of the solver's mesh; 0 for NULL, busy and failed handles. The skin is part of them, or rides on them.
//
// # Safety
// `sim` is NULL or a live handle.
size_t cutis_node_count(const struct CutisSim *sim);

// Copies the current positions of all nodes, m: three numbers a node.
//
// CUTIS_ARGUMENT: `len` is not three times cutis_node_count; `positions` is untouched then.
//
// # Safety
// `sim` is NULL or a live handle; `positions` is NULL or holds `len` numbers.
enum CutisStatus cutis_sim_nodes(const struct CutisSim *sim, double *positions, size_t len);

// Puts the nodes that no bone holds at `positions` (m, three numbers for each node of cutis_sim_nodes): the next step seeks the
// equilibrium from there. Nodes of bones, time, velocities and outputs stay as they are until then.
//
// CUTIS_ARGUMENT: `len` is not three times cutis_node_count, or a position is not finite; nothing has changed then.
//
// # Safety
// `sim` is NULL or a live handle; `positions` is NULL or holds `len` numbers.
enum CutisStatus cutis_sim_start_from(struct CutisSim *sim,
                                      const double *positions,
                                      size_t len);

// Bytes of matrices, factor and solver of a simulation, its model and state left out; 0 for NULL, busy and failed handles.
//
// # Safety
// `sim` is NULL or a live handle.
size_t cutis_sim_memory(const struct CutisSim *sim);

// Change of `unknowns` with `knowns` along `seed`: the Jacobian of the last accepted equilibrium times a vector; in scenes with
// inertia or memory that of the last step (of its last piece, where it was cut), the state before it held.
//
// `unknowns` are Float64 outputs (of skin, markers, bones, contacts and energies; not those of solver and quality) or inputs,
// `knowns` are inputs and parameters; arrays hold the values of their ports one after another,
// row-major, in SI units. The simulation does not change; one linear solve, and a factorisation where the state is new.
//
// CUTIS_ARGUMENT: no such ports, the seed is not finite, or `seed_len` or `sensitivity_len` are not the values of `knowns` and `unknowns`. CUTIS_STEP:
// there is no equilibrium yet, or in scenes with inertia or memory positions were set since the last step. `sensitivity` is then of
// no use.
//
// # Safety
// `sim` is NULL or a live handle; each pointer is NULL or holds as many elements as the length after it says.
enum CutisStatus cutis_sim_directional_derivative(struct CutisSim *sim,
                                                  const size_t *unknowns,
                                                  size_t n_unknowns,
                                                  const size_t *knowns,
                                                  size_t n_knowns,
                                                  const double *seed,
                                                  size_t seed_len,
                                                  double *sensitivity,
                                                  size_t sensitivity_len);

// Gradient of the `unknowns` weighted by `seed` by all `knowns` at once: the transposed Jacobian times a vector.
//
// `unknowns` are Float64 outputs (of skin, markers, bones, contacts and energies; not those of solver and quality) or inputs,
// `knowns` are inputs and parameters; arrays hold the values of their ports one after another,
// row-major, in SI units. The simulation does not change; one linear solve, and a factorisation where the state is new.
//
// CUTIS_ARGUMENT: no such ports, the seed is not finite, or `seed_len` or `sensitivity_len` are not the values of `unknowns` and `knowns`. CUTIS_STEP:
// there is no equilibrium yet, or in scenes with inertia or memory positions were set since the last step. `sensitivity` is then of
// no use.
//
// # Safety
// `sim` is NULL or a live handle; each pointer is NULL or holds as many elements as the length after it says.
enum CutisStatus cutis_sim_adjoint_derivative(struct CutisSim *sim,
                                              const size_t *unknowns,
                                              size_t n_unknowns,
                                              const size_t *knowns,
                                              size_t n_knowns,
                                              const double *seed,
                                              size_t seed_len,
                                              double *sensitivity,
                                              size_t sensitivity_len);

// Simulation time, s; NaN for NULL, busy and failed handles.
//
// # Safety
// `sim` is NULL or a live handle.
double cutis_sim_time(const struct CutisSim *sim);

// Back to rest, t = 0 s and the start values of the scene, as if new.
//
// # Safety
// `sim` is NULL or a live handle.
enum CutisStatus cutis_sim_reset(struct CutisSim *sim);

// A copy of all that moves: time, positions, inputs, history. NULL on failure. Free with cutis_state_free.
//
// # Safety
// `sim` is NULL or a live handle.
struct CutisState *cutis_sim_save(const struct CutisSim *sim);

// Goes back to a saved state: from then on every step has the same bits as after the save. A simulation that is new goes on from
// there, too: it is not to be initialised then.
//
// CUTIS_STATE: it belongs to another scene, be it one of the same mesh with another material; nothing was changed.
//
// # Safety
// `sim` is NULL or a live handle; `state` is NULL or a live state.
enum CutisStatus cutis_sim_restore(struct CutisSim *sim,
                                   const struct CutisState *state);

// Frees a saved state. NULL is no error.
//
// # Safety
// `state` is NULL or a live state that no other thread uses.
void cutis_state_free(struct CutisState *state);

// Bytes that cutis_state_serialize needs for `state`; 0 on failure, and for a state of another scene.
//
// # Safety
// `sim` is NULL or a live handle; `state` is NULL or a live state.
size_t cutis_state_size(const struct CutisSim *sim, const struct CutisState *state);

// Writes `state` as bytes that another process can read: little-endian, with format number, scene and checksum.
//
// CUTIS_ARGUMENT: `len` is less than cutis_state_size. CUTIS_STATE: it belongs to another scene.
//
// # Safety
// `sim` is NULL or a live handle; `state` is NULL or a live state; `bytes` is NULL or holds `len`
// bytes.
enum CutisStatus cutis_state_serialize(const struct CutisSim *sim,
                                       const struct CutisState *state,
                                       uint8_t *bytes,
                                       size_t len);

// Reads bytes of cutis_state_serialize into a new state at `*state`. Free with cutis_state_free.
//
// CUTIS_STATE: the bytes are damaged or belong to another scene or version; `*state` is untouched then.
//
// # Safety
// `sim` is NULL or a live handle; `bytes` is NULL or holds `len` bytes; `state` is NULL or the place of a pointer.
enum CutisStatus cutis_state_deserialize(const struct CutisSim *sim,
                                         const uint8_t *bytes,
                                         size_t len,
                                         struct CutisState **state);

// Tells instantiations apart in logs: the token of the scene, as in the FMI model description. Copies as
// cutis_sim_message does; 0 on failure.
//
// # Safety
// `sim` is NULL or a live handle; `buffer` is NULL or holds `len` bytes.
size_t cutis_sim_token(const struct CutisSim *sim, char *buffer, size_t len);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* CUTIS_H */
