"""The C library through ctypes: what include/cutis.h says, and no more."""

import ctypes
from ctypes import POINTER, c_char_p, c_double, c_int, c_size_t, c_ubyte, c_void_p

import numpy as np

OK = 0
TYPES = {0: c_double, 1: c_int, 2: c_ubyte}


class Failed(Exception):
    """A status other than CUTIS_OK, with the library's message."""


class Library:
    def __init__(self, path):
        self.c = ctypes.CDLL(str(path))
        text = [c_char_p, c_size_t]
        signatures = {
            "cutis_sim_new_from_file": (c_void_p, [c_char_p] + text),
            "cutis_sim_new_from_text": (c_void_p, [c_char_p, c_char_p] + text),
            "cutis_sim_new_default": (c_void_p, text),
            "cutis_sim_free": (None, [c_void_p]),
            "cutis_sim_message": (c_size_t, [c_void_p] + text),
            "cutis_sim_token": (c_size_t, [c_void_p] + text),
            "cutis_port_count": (c_size_t, [c_void_p]),
            "cutis_port_find": (c_size_t, [c_void_p, c_char_p]),
            "cutis_port_name": (c_size_t, [c_void_p, c_size_t] + text),
            "cutis_port_row": (c_size_t, [c_void_p, c_size_t, c_size_t] + text),
            "cutis_port_rank": (c_size_t, [c_void_p, c_size_t]),
            "cutis_port_dim": (c_size_t, [c_void_p, c_size_t, c_size_t]),
            "cutis_port_len": (c_size_t, [c_void_p, c_size_t]),
            "cutis_port_type": (c_int, [c_void_p, c_size_t]),
            "cutis_sim_set_f64": (c_int, [c_void_p, c_size_t, POINTER(c_double), c_size_t]),
            "cutis_sim_get_f64": (c_int, [c_void_p, c_size_t, POINTER(c_double), c_size_t]),
            "cutis_sim_get_i32": (c_int, [c_void_p, c_size_t, POINTER(c_int), c_size_t]),
            "cutis_sim_get_bool": (c_int, [c_void_p, c_size_t, POINTER(c_ubyte), c_size_t]),
            "cutis_sim_set_time": (c_int, [c_void_p, c_double]),
            "cutis_sim_initialise": (c_int, [c_void_p]),
            "cutis_sim_step": (c_int, [c_void_p, c_double]),
            "cutis_sim_time": (c_double, [c_void_p]),
            "cutis_sim_reset": (c_int, [c_void_p]),
        }
        for name, (result, arguments) in signatures.items():
            function = getattr(self.c, name)
            function.restype, function.argtypes = result, arguments

    def from_file(self, path):
        return Sim(self, self._new("cutis_sim_new_from_file", str(path).encode()))

    def from_text(self, text, folder):
        return Sim(self, self._new("cutis_sim_new_from_text", text.encode(), str(folder).encode()))

    def default(self):
        return Sim(self, self._new("cutis_sim_new_default"))

    def _new(self, name, *arguments):
        why = ctypes.create_string_buffer(1024)
        handle = getattr(self.c, name)(*arguments, why, len(why))
        if not handle:
            raise Failed(why.value.decode())
        return handle


class Sim:
    def __init__(self, library, handle):
        self.c, self.handle = library.c, handle

    def __del__(self):
        self.c.cutis_sim_free(self.handle)

    def _check(self, status):
        if status != OK:
            raise Failed(self._text(self.c.cutis_sim_message))

    def _text(self, function, *arguments):
        buffer = ctypes.create_string_buffer(1024)
        return buffer.value.decode() if function(self.handle, *arguments, buffer, len(buffer)) else None

    def find(self, name):
        port = self.c.cutis_port_find(self.handle, name.encode())
        if port == c_size_t(-1).value:
            raise Failed(self._text(self.c.cutis_sim_message))
        return port

    def names(self):
        return [self._text(self.c.cutis_port_name, i) for i in range(self.c.cutis_port_count(self.handle))]

    def shape(self, name):
        port = self.find(name)
        return tuple(self.c.cutis_port_dim(self.handle, port, k) for k in range(self.c.cutis_port_rank(self.handle, port)))

    def rows(self, name):
        port = self.find(name)
        return [self._text(self.c.cutis_port_row, port, k) for k in range(self.shape(name)[0])]

    def token(self):
        return self._text(self.c.cutis_sim_token)

    def set(self, name, values):
        values = np.ascontiguousarray(values, dtype=np.float64).ravel()
        pointer = values.ctypes.data_as(POINTER(c_double))
        self._check(self.c.cutis_sim_set_f64(self.handle, self.find(name), pointer, values.size))

    def get(self, name):
        port = self.find(name)
        kind = TYPES[self.c.cutis_port_type(self.handle, port)]
        values = (kind * self.c.cutis_port_len(self.handle, port))()
        get = {c_double: self.c.cutis_sim_get_f64, c_int: self.c.cutis_sim_get_i32, c_ubyte: self.c.cutis_sim_get_bool}[kind]
        self._check(get(self.handle, port, values, len(values)))
        return np.array(values).reshape(self.shape(name))

    def initialise(self):
        self._check(self.c.cutis_sim_initialise(self.handle))

    def step(self, dt):
        self._check(self.c.cutis_sim_step(self.handle, dt))

    def time(self):
        return self.c.cutis_sim_time(self.handle)

    def reset(self):
        self._check(self.c.cutis_sim_reset(self.handle))
