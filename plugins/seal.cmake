# cmake -DLIBRARY=FILE -P seal.cmake: appends the checksum of a plugin library to it, by which the
# kernel knows a damaged file before it opens it. Loaders do not read behind the end of the sections.
file(MD5 ${LIBRARY} sum)
file(APPEND ${LIBRARY} "SIM-PLUGIN-MD5 ${sum}\n")
