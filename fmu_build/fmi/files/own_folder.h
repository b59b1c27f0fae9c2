/* own_folder.h - where this binary lies. */
#ifndef FMI_OWN_FOLDER_H
#define FMI_OWN_FOLDER_H

/* the folder of this binary followed by `path`, in UTF-8, to be freed; NULL if the system does not tell */
char *fmi_beside(const char *path);
#endif
