// mesh/io
